//! Orders that wait for the present one (MACCON MAC4 User Manual, section 5.15, "off-fly" operation).

use std::collections::VecDeque;

use crate::order::Order;

/// No more orders can wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueueFull;

impl core::fmt::Display for QueueFull {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "{} orders are waiting already", Queue::LENGTH)
    }
}

impl core::error::Error for QueueFull {}

/// Waiting orders, first in, first out; it allocates when made and never again.
#[derive(Clone, Debug)]
pub(super) struct Queue(VecDeque<Order>);

impl Queue {
    /// Orders that may wait.
    const LENGTH: usize = 16;

    pub(super) fn new() -> Self {
        Self(VecDeque::with_capacity(Self::LENGTH))
    }

    pub(super) fn push(&mut self, order: Order) -> Result<(), QueueFull> {
        if self.0.len() == Self::LENGTH {
            return Err(QueueFull);
        }
        self.0.push_back(order);
        Ok(())
    }

    pub(super) fn pop(&mut self) -> Option<Order> {
        self.0.pop_front()
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}
