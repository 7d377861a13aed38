//! What the figures were measured on.

use serde::Serialize;

/// The machine and the build, for the report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// Processor model.
    pub cpu: String,
    /// Threads that parallel work runs on.
    pub threads: usize,
    /// Vector extensions that the processor offers, those that matter here.
    pub simd: String,
    /// Operating system and architecture.
    pub system: String,
    /// Physical memory in bytes, where the system tells.
    pub memory_bytes: Option<u64>,
    /// Version and kind of build.
    pub build: String,
    /// Cargo features of the build.
    pub features: String,
}

impl Machine {
    /// Asks the system.
    pub fn describe() -> Self {
        let optimised = if cfg!(debug_assertions) {
            "debug"
        } else {
            "release"
        };
        let features = [
            ("wave-equation", cfg!(feature = "wave-equation")),
            ("procedural", cfg!(feature = "procedural")),
            ("shallow-water", cfg!(feature = "shallow-water")),
            ("wave-particles", cfg!(feature = "wave-particles")),
            ("export", cfg!(feature = "export")),
            ("gpu", cfg!(feature = "gpu")),
        ];
        let features: Vec<&str> = features.into_iter().filter(|f| f.1).map(|f| f.0).collect();
        Self {
            cpu: field("/proc/cpuinfo", "model name").unwrap_or_else(|| "unknown processor".to_owned()),
            threads: rayon::current_num_threads(),
            simd: simd(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            memory_bytes: field("/proc/meminfo", "MemTotal")
                .and_then(|text| text.strip_suffix("kB")?.trim().parse::<u64>().ok())
                .map(|kib| kib * 1024),
            build: format!("meniscus {} ({optimised})", env!("CARGO_PKG_VERSION")),
            features: features.join(", "),
        }
    }

    /// One line for the report.
    pub fn line(&self) -> String {
        let threads = if self.threads == 1 { "thread" } else { "threads" };
        let memory = self.memory_bytes.map_or(String::new(), |b| {
            format!(", {:.0} GiB", b as f64 / f64::from(1 << 30))
        });
        format!(
            "{}, {} {threads}{memory}, {} ({}); {}; features: {}",
            self.cpu, self.threads, self.system, self.simd, self.build, self.features
        )
    }
}

/// Value of the first line `name : value` of a file of the proc file system.
fn field(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    text.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == name).then(|| value.trim().to_owned())
    })
}

#[cfg(target_arch = "x86_64")]
fn simd() -> String {
    let offers = [
        ("AVX-512", std::arch::is_x86_feature_detected!("avx512f")),
        ("AVX2", std::arch::is_x86_feature_detected!("avx2")),
        ("FMA", std::arch::is_x86_feature_detected!("fma")),
    ];
    let names: Vec<&str> = offers.into_iter().filter(|o| o.1).map(|o| o.0).collect();
    if names.is_empty() {
        "SSE2".to_owned()
    } else {
        names.join(", ")
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn simd() -> String {
    "baseline vectors".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_names_processor_threads_and_build() {
        let machine = Machine::describe();
        let line = machine.line();
        assert!(
            machine.threads >= 1 && line.contains(&machine.cpu) && line.contains("meniscus "),
            "{line}"
        );
        if cfg!(target_os = "linux") {
            assert!(machine.memory_bytes.is_some_and(|b| b > 1 << 26), "{line}");
        }
    }
}
