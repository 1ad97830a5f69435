//! Storage of a list for another list whose elements borrow for another lifetime.

/// The storage of `list` as an empty list of `B`. It stays where it is if both types have the same layout, as one type with two lifetimes
/// has.
#[must_use]
pub fn recycled<A, B>(mut list: Vec<A>) -> Vec<B> {
    list.clear();
    // nothing is left to be mapped; the standard library collects in place, so that the storage stays
    list.into_iter().map(|_| unreachable!("cleared above")).collect()
}

#[cfg(test)]
mod tests {
    use super::recycled;

    #[test]
    fn the_storage_stays() {
        let mut list: Vec<&str> = Vec::with_capacity(7);
        let place = list.as_ptr();
        for _ in 0..3 {
            let word = String::from("lives shorter than the storage");
            let mut round: Vec<&str> = recycled(std::mem::take(&mut list));
            round.extend([&*word; 7]);
            assert_eq!(round.as_ptr(), place);
            list = recycled(round);
        }
        assert_eq!((list.len(), list.capacity()), (0, 7));
    }
}
