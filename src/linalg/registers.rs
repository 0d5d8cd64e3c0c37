//! The vector registers after matrix products: the kernels of `faer` leave their upper halves filled.

use faer::linalg::matmul;
use faer::traits::ComplexField;
use faer::{Accum, MatMut, MatRef, Par};

/// Does work that multiplies matrices, and empties the upper halves of the vector registers after it. While there is anything in them, each change
/// between code that was built with AVX and without costs a hundred cycles: an exponential of the C library takes 90 ns then, and 5 ns
/// otherwise.
#[inline(always)]
pub(super) fn cleared<R>(work: impl FnOnce() -> R) -> R {
    let out = work();
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        simd.avx._mm256_zeroupper();
    }
    out
}

/// `target += factor * a * b`, or in its place.
pub(super) fn multiply<T: ComplexField>(
    target: MatMut<'_, T>,
    mode: Accum,
    a: MatRef<'_, T>,
    b: MatRef<'_, T>,
    factor: T,
) {
    cleared(|| matmul::matmul(target, mode, a, b, factor, Par::Seq));
}
