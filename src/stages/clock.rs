//! Measurement of the wall time and the processor time of work. No result of a run depends on the measured times.

use std::time::Instant;

/// Time spent on work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkCost {
    /// Wall time \[s\].
    pub seconds: f64,
    /// Processor time of all threads of the program \[s\]; `None` if the system does not report the processor time.
    pub cpu_seconds: Option<f64>,
}

impl WorkCost {
    /// Returns the cost without the cost of a `part`.
    pub fn less(self, part: WorkCost) -> WorkCost {
        let cpu = self.cpu_seconds.zip(part.cpu_seconds);
        WorkCost {
            seconds: self.seconds - part.seconds,
            cpu_seconds: cpu.map(|(whole, part)| whole - part),
        }
    }
}

/// Start of a measurement.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    wall: Instant,
    cpu: Option<f64>,
}

impl Clock {
    /// Starts a measurement.
    pub fn begin() -> Clock {
        Clock {
            wall: Instant::now(),
            cpu: cpu_time(),
        }
    }

    /// Returns the time spent since the start.
    pub fn spent(&self) -> WorkCost {
        let cpu = cpu_time().zip(self.cpu);
        WorkCost {
            seconds: self.wall.elapsed().as_secs_f64(),
            cpu_seconds: cpu.map(|(now, begin)| now - begin),
        }
    }
}

/// Returns the processor time since the program started \[s\].
#[cfg(unix)]
fn cpu_time() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

/// Without a safe system call, the processor time is unknown.
#[cfg(not(unix))]
fn cpu_time() -> Option<f64> {
    None
}
