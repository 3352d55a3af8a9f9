//! The block that says what the gripper knows beyond the convention.

/// The block's memory.
#[derive(Debug, Clone, Copy)]
pub struct Own {}

impl Own {
    /// Nothing has been written.
    pub const fn new() -> Self {
        Self {}
    }
}
