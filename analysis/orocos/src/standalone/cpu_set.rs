//! CPUs, as mains say them.

use mauve_timing::CpuSet;

/// Returns a set of CPUs: a mask, or the numbers of more CPUs than C++ has bits for.
pub(super) fn cpu_set(cpus: CpuSet) -> String {
    match u64::try_from(cpus.0) {
        Ok(mask) => format!("{mask:#x}"),
        Err(_) => {
            let numbers: Vec<String> = cpus.iter().map(|cpu| cpu.to_string()).collect();
            format!("mauve::cpus({{{}}})", numbers.join(", "))
        }
    }
}
