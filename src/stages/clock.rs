//! What work takes: by the clock on the wall, and of the processor. No result depends on either.

use std::time::Instant;

/// What work took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkCost {
    /// Wall time \[s\].
    pub seconds: f64,
    /// Time of the processor, of all threads of the program together \[s\]; none where the system does not tell it.
    pub cpu_seconds: Option<f64>,
}

impl WorkCost {
    /// Without a part of it.
    pub fn less(self, part: WorkCost) -> WorkCost {
        let cpu = self.cpu_seconds.zip(part.cpu_seconds);
        WorkCost {
            seconds: self.seconds - part.seconds,
            cpu_seconds: cpu.map(|(whole, part)| whole - part),
        }
    }
}

/// The beginning of some work.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    wall: Instant,
    cpu: Option<f64>,
}

impl Clock {
    /// Begins now.
    pub fn begin() -> Clock {
        Clock {
            wall: Instant::now(),
            cpu: processor(),
        }
    }

    /// What was spent since.
    pub fn spent(&self) -> WorkCost {
        let cpu = processor().zip(self.cpu);
        WorkCost {
            seconds: self.wall.elapsed().as_secs_f64(),
            cpu_seconds: cpu.map(|(now, begin)| now - begin),
        }
    }
}

/// Time of the processor since the program began \[s\].
#[cfg(unix)]
fn processor() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

/// No system call for it that is safe.
#[cfg(not(unix))]
fn processor() -> Option<f64> {
    None
}
