use onemesh::preflight::{Finding, Severity};

/// Prints findings, or that there are none.
pub fn print_findings(findings: &[Finding]) {
    if findings.is_empty() {
        say!("  nothing is wrong");
    }
    for finding in findings {
        let Finding { code, severity, found, advice, .. } = finding;
        say!("  {:8}    {found} [{}]", severity.name(), code.name());
        say!("              -> {advice}");
    }
}

/// Warns, on the error stream, of what may spoil a registration.
pub fn warn(scan: &str, findings: &[Finding]) {
    for finding in findings.iter().filter(|finding| finding.severity > Severity::Info) {
        remark!("{scan}: {finding}");
    }
}
