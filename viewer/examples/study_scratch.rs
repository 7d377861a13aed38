//! scratch
use std::sync::atomic::AtomicBool;
fn main() {
    let mut o = meniscus::study::StudyOptions::default();
    let mut args = std::env::args().skip(1);
    while let Some(a) = args.next() {
        match a.as_str() {
            "--quick" => o.quick = true,
            "--check" => o.check = true,
            "--list" => o.list = true,
            "-o" => o.out = args.next().map(Into::into),
            n => o.names.push(n.into()),
        }
    }
    match meniscus::study::run(&o, &AtomicBool::new(false)) {
        Ok(r) => {
            print!("{}", r.text);
            std::process::exit(if r.failures().is_empty() { 0 } else { 1 })
        }
        Err(e) => {
            println!("{e:#}");
            std::process::exit(2)
        }
    }
}
