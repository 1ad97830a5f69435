//! Answers a file of worked cases: `cargo run -p metachron-lod --example solve -- CASES ANSWERS`.
//!
//! In: a case file. Out: a file with one answer for every policy of every case, and a line that counts them.

mod answer;

use std::process::ExitCode;

fn main() -> ExitCode {
    let paths: Vec<_> = std::env::args().skip(1).collect();
    let [cases, answers] = paths.as_slice() else {
        eprintln!("usage: solve CASES ANSWERS");
        return ExitCode::from(2);
    };
    match solve(cases, answers) {
        Ok(count) => {
            println!("{count} answers in {answers}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("solve: {why}");
            ExitCode::FAILURE
        }
    }
}

fn solve(cases: &str, answers: &str) -> Result<usize, String> {
    let text = std::fs::read_to_string(cases).map_err(|e| format!("{cases}: {e}"))?;
    let file = serde_json::from_str(&text).map_err(|e| format!("{cases}: {e}"))?;
    let list = answer::answers(&file).map_err(|e| format!("{cases}: {e}"))?;
    let text = serde_json::to_string_pretty(&list).map_err(|e| e.to_string())?;
    std::fs::write(answers, text).map_err(|e| format!("{answers}: {e}"))?;
    Ok(list.len())
}
