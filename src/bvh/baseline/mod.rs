//! Simpler ways to find the same hits, to measure and to check the kernels against.

pub mod binary_traversal;
pub mod brute;
pub mod check;
