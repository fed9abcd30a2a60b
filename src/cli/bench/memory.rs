use std::fs;

/// Forgets the largest amount of memory that was held, so that [`peak`] tells of what comes; where the system can.
pub fn forget_peak() {
    // Where it cannot, the peak is that of the whole run, which is no less.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// The largest amount of memory that was held, in MiB; `None` where the system does not say.
pub fn peak() -> Option<f64> {
    mebibytes("self", "VmHWM:")
}

/// The same of another process.
pub fn peak_of(process: u32) -> Option<f64> {
    mebibytes(&process.to_string(), "VmHWM:")
}

/// The memory that is held now, in MiB; `None` where the system does not say.
pub fn resident() -> Option<f64> {
    mebibytes("self", "VmRSS:")
}

fn mebibytes(process: &str, field: &str) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(field))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes / 1024.0)
}
