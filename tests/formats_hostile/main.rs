//! Files that mean harm: no reader panics, hangs, or takes memory that the file has no bytes for.

mod allocator;
mod captures;
mod damage;
mod memory;
mod mutation;
mod seeds;
