//! How much memory there is, so that a scene that cannot fit is refused instead of ending the process.

use super::failure::Failure;
use super::format;
use std::fs;

/// Refuses work that would hold `needed` bytes where fewer can be had; `what` says what needs them, `remedy` what to
/// change. Where the system does not say how much there is, everything is let through.
///
/// # Errors
/// [`Failure::Input`] with both figures.
pub(crate) fn require(needed: u64, what: &str, remedy: &str) -> Result<(), Failure> {
    match available() {
        Some(available) if needed > available => Err(Failure::input(format_args!(
            "{what} needs at least {}, but {} of memory can be had; {remedy}",
            format::bytes(needed),
            format::bytes(available)
        ))),
        _ => Ok(()),
    }
}

/// Bytes that this process can still get: the least of what the machine has free, what its control group allows and
/// what its address-space limit leaves.
fn available() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).ok();
    let machine = read("/proc/meminfo").and_then(|text| kibibytes(&text, "MemAvailable:"));
    let group = read("/sys/fs/cgroup/memory.max")
        .zip(read("/sys/fs/cgroup/memory.current"))
        .zip(read("/sys/fs/cgroup/memory.stat"))
        .and_then(|((max, current), stat)| group_room(&max, &current, &stat));
    let limit = read("/proc/self/limits").and_then(|text| address_space_limit(&text));
    let used = read("/proc/self/status").and_then(|text| kibibytes(&text, "VmSize:"));
    let space = limit.map(|limit| limit.saturating_sub(used.unwrap_or(0)));
    [machine, group, space].into_iter().flatten().min()
}

/// The bytes of a line `name  N kB`.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim()
        .strip_suffix("kB")?
        .trim()
        .parse::<u64>()
        .ok()?
        .checked_mul(1024)
}

/// What a control group still lets its processes have; file pages that it can drop count as free.
fn group_room(max: &str, current: &str, stat: &str) -> Option<u64> {
    let max: u64 = max.trim().parse().ok()?;
    let current: u64 = current.trim().parse().ok()?;
    let inactive = stat.lines().find_map(|line| line.strip_prefix("inactive_file "));
    let inactive: u64 = inactive.and_then(|text| text.trim().parse().ok()).unwrap_or(0);
    Some(max.saturating_sub(current.saturating_sub(inactive)))
}

/// The soft limit of the address space in bytes, where there is one.
fn address_space_limit(text: &str) -> Option<u64> {
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_systems_figures_are_read() {
        assert_eq!(
            kibibytes("MemTotal:  9 kB\nMemAvailable:   2048 kB\n", "MemAvailable:"),
            Some(2 << 20)
        );
        assert_eq!(
            group_room("1000\n", "700\n", "file 9\ninactive_file 200\n"),
            Some(500)
        );
        assert_eq!(group_room("max\n", "700\n", ""), None);
        let limits = "Limit  Soft Limit  Hard Limit  Units\nMax address space  4096  unlimited  bytes\n";
        assert_eq!(address_space_limit(limits), Some(4096));
        assert_eq!(address_space_limit(&limits.replace("4096", "unlimited")), None);
    }

    #[test]
    fn what_cannot_fit_is_refused_with_both_figures() {
        if available().is_some() {
            let message = require(u64::MAX, "the scene", "shrink it")
                .unwrap_err()
                .to_string();
            assert!(
                message.starts_with("the scene needs at least 16.0 EiB, but ")
                    && message.ends_with("; shrink it"),
                "{message}"
            );
        }
        require(0, "nothing", "").unwrap();
    }
}
