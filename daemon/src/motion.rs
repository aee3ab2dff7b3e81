//! What a local master does to move an axis: it reads and writes the objects of CiA 402, step by step.
//!
//! There is no I/O and no clock in here. Whoever drives a [`Sequence`] reads the axis ([`View`]) a few times a second,
//! hands the view in and does what comes out ([`Next`]). A sequence always ends: with the target, with a refusal, with a
//! fault, when nothing moves any more, or when it is interrupted; then the axis is halted first.

mod sequence;
mod view;

pub use sequence::{Goal, Next, Sequence, Setting, is_optional};
pub use view::{READ, View, part};
