//! An agent's contact shape, for contact, pictures and queries: the newest, which is another one where matter was taken
//! out of the agent.
//!
//! In: the shape at the start, and each one after. Out: the newest, without waiting. A shape never changes; a reader knows a new one by its
//! address. Whatever state of the agent it is read with, its vertices are those of the state. Never here: when an agent has another shape.

use arc_swap::{ArcSwapOption, Guard};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

/// A shape, `None` where nothing can touch the agent.
type Form = Option<Arc<CollisionShape>>;

/// Where an agent's newest shape is. All have the same kind and traits.
#[derive(Debug, Default)]
pub(crate) struct FormSlot(ArcSwapOption<CollisionShape>);

impl FormSlot {
    pub fn new(first: Form) -> Self {
        Self(ArcSwapOption::new(first))
    }

    /// The newest shape, for a look.
    pub fn look(&self) -> Guard<Form> {
        self.0.load()
    }

    /// The newest shape, to keep.
    pub fn latest(&self) -> Form {
        self.0.load_full()
    }

    /// Puts the newest shape in the place of one that a reader has.
    pub fn renew(&self, held: &mut Form) {
        if held.is_some() && !is_same(held.as_ref(), self.look().as_ref()) {
            *held = self.latest();
        }
    }

    /// Publishes `form`, unless it is the newest already.
    pub fn publish(&self, form: Form) {
        if !is_same(form.as_ref(), self.look().as_ref()) {
            self.0.store(form);
        }
    }
}

fn is_same(a: Option<&Arc<CollisionShape>>, b: Option<&Arc<CollisionShape>>) -> bool {
    a.map(Arc::as_ptr) == b.map(Arc::as_ptr)
}
