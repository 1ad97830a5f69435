//! Cost of publishing a state and of reading the newest one, against the size of the state.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use metachron_runtime::SlotWriter;

fn publish_and_read(c: &mut Criterion) {
    let mut group = c.benchmark_group("runtime/slot");
    for words in [8_usize, 512] {
        let mut writer = SlotWriter::new(vec![0_u64; words]);
        let slot = writer.slot();
        let mut value = 0;
        group.throughput(Throughput::Bytes(8 * words as u64));
        group.bench_function(BenchmarkId::new("publish", words), |b| {
            b.iter(|| {
                value += 1;
                writer.fill(|state| {
                    state.clear();
                    state.resize(words, value);
                });
                writer.publish()
            });
        });
        group.bench_function(BenchmarkId::new("read", words), |b| b.iter(|| slot.latest()[0]));
    }
    group.finish();
}

criterion_group!(benches, publish_and_read);
criterion_main!(benches);
