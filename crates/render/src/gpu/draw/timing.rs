//! GPU time of frames by time stamps, read back without waiting.
//!
//! In: passes to stamp. Out: the duration of the newest finished frame. Never here: the CPU's clock.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

/// Frames whose stamps may be pending simultaneously.
const RING: usize = 3;
/// Two stamps of 64 bits.
const BYTES: u64 = 16;

const IDLE: u8 = 0;
const WAITING: u8 = 1;
const READY: u8 = 2;

/// Stamps around a frame's passes.
#[derive(Debug)]
pub struct Timing {
    stamps: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    ring: Vec<(wgpu::Buffer, Arc<AtomicU8>)>,
    next: Option<usize>,
    period_ns: f64,
    newest: Option<Duration>,
}

impl Timing {
    /// Time stamps; `None` if the device has no such feature.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |usage| {
            let label = Some("time stamps");
            device.create_buffer(&wgpu::BufferDescriptor { label, size: BYTES, usage, mapped_at_creation: false })
        };
        let kept = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        Some(Self {
            stamps: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("time stamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            ring: (0..RING).map(|_| (buffer(kept), Arc::new(AtomicU8::new(IDLE)))).collect(),
            next: None,
            period_ns: f64::from(queue.get_timestamp_period()),
            newest: None,
        })
    }

    /// Stamps the beginning of the first pass.
    pub fn first_pass(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.stamps,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: None,
        }
    }

    /// Stamps the end of the last pass.
    pub fn last_pass(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.stamps,
            beginning_of_pass_write_index: None,
            end_of_pass_write_index: Some(1),
        }
    }

    /// Copies the stamps of this frame to where they can be read, if a buffer is free.
    pub fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.collect();
        self.next = self.ring.iter().position(|(_, state)| state.load(Ordering::Acquire) == IDLE);
        if let Some(slot) = self.next {
            encoder.resolve_query_set(&self.stamps, 0..2, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.ring[slot].0, 0, BYTES);
        }
    }

    /// Requests the stamps of the frame just submitted.
    pub fn request(&mut self) {
        let Some(slot) = self.next.take() else { return };
        let (buffer, state) = &self.ring[slot];
        state.store(WAITING, Ordering::Release);
        let done = Arc::clone(state);
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            done.store(if result.is_ok() { READY } else { IDLE }, Ordering::Release);
        });
    }

    /// The duration of the newest frame whose stamps are back.
    pub fn newest(&mut self) -> Option<Duration> {
        self.collect();
        self.newest
    }

    fn collect(&mut self) {
        for (buffer, state) in &self.ring {
            if state.load(Ordering::Acquire) != READY {
                continue;
            }
            if let Ok(bytes) = buffer.get_mapped_range(..) {
                let stamp = |at: usize| bytes[at..at + 8].try_into().map_or(0, u64::from_le_bytes);
                let ticks = stamp(8).saturating_sub(stamp(0));
                self.newest = Some(Duration::from_nanos((ticks as f64 * self.period_ns) as u64));
            }
            buffer.unmap();
            state.store(IDLE, Ordering::Release);
        }
    }
}
