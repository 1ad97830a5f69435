//! An optional value that most states lack, in storage of its own.
//!
//! In: values that appear and disappear. Out: the newest, or none; the storage is kept, so that a new value needs no allocation.
//! Never here: what the values mean.

/// An optional value. Empty, it takes two words, however large the value would be.
#[derive(Debug, Clone)]
pub struct ReusableOption<T> {
    storage: Option<Box<T>>,
    is_there: bool,
}

impl<T> Default for ReusableOption<T> {
    fn default() -> Self {
        Self { storage: None, is_there: false }
    }
}

impl<T> ReusableOption<T> {
    /// The value, if there is one.
    #[must_use]
    pub fn get(&self) -> Option<&T> {
        self.storage.as_deref().filter(|_| self.is_there)
    }

    /// Replaces the value.
    pub fn set(&mut self, value: Option<T>) {
        self.is_there = value.is_some();
        let Some(value) = value else { return };
        match &mut self.storage {
            Some(storage) => **storage = value,
            None => self.storage = Some(Box::new(value)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_set_again_reuses_its_storage() {
        let mut rare = ReusableOption::default();
        assert_eq!(rare.get(), None);
        rare.set(Some([1.0; 90]));
        let coming_and_going = allocation_counter::measure(|| {
            rare.set(None);
            assert_eq!(rare.get(), None);
            rare.set(Some([2.0; 90]));
        });
        assert_eq!(coming_and_going.count_total, 0);
        assert_eq!(rare.get(), Some(&[2.0; 90]));
    }
}
