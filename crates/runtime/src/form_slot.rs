//! An agent's contact shape, for those who touch, draw and ask: the newest, which is another one where matter was taken out of the agent.
//!
//! In: the shape at the start, and each one after. Out: the newest, without waiting. A shape never changes; a reader knows a new one by its
//! address. Whatever state of the agent it is read with, its vertices are those of the state. Never here: when an agent has another shape.

use super::slot::{LatestSlot, SlotWriter};
use metachron_geometry::CollisionShape;
use std::sync::{Arc, OnceLock};

/// A shape, `None` where nothing can touch the agent.
type Form = Option<Arc<CollisionShape>>;

/// Where an agent's newest shape is.
#[derive(Debug, Default)]
pub(super) struct FormSlot {
    first: Form,
    /// Made for the second one: most agents never have any.
    newer: OnceLock<Arc<LatestSlot<Form>>>,
}

/// What writes a [`FormSlot`]; one thread at a time.
pub(super) type FormWriter = Option<Box<SlotWriter<Form>>>;

impl FormSlot {
    pub const fn new(first: Form) -> Self {
        Self { first, newer: OnceLock::new() }
    }

    /// The first shape: its kind and traits stay.
    pub fn first(&self) -> Option<&CollisionShape> {
        self.first.as_deref()
    }

    /// The newest shape.
    pub fn latest(&self) -> Form {
        self.newer.get().map_or_else(|| self.first.clone(), |slot| slot.latest().as_ref().clone())
    }

    /// Puts the newest shape in the place of one that a reader has.
    pub fn renew(&self, held: &mut Form) {
        if held.is_some() && self.newer.get().is_some() {
            *held = self.latest();
        }
    }

    /// Publishes `form`, unless it is the newest already.
    pub fn publish(&self, writer: &mut FormWriter, form: Form) {
        let same = |a: &Arc<CollisionShape>, b: &Arc<CollisionShape>| Arc::ptr_eq(a, b);
        if self.latest().as_ref().zip(form.as_ref()).is_none_or(|(newest, form)| same(newest, form)) {
            return;
        }
        match writer {
            Some(writer) => writer.replace(Arc::new(form)),
            None => {
                let made = writer.insert(Box::new(SlotWriter::new(form)));
                self.newer.get_or_init(|| made.slot());
            }
        }
    }
}
