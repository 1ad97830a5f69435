//! Lists that keep their storage from step to step, and such as are sorted by keys.
//!
//! In: a list, values. Out: the list with these, or the one entry sought. Never here: the meaning of values.

/// Other values in the storage of a list.
pub(crate) fn refill<T>(list: &mut Vec<T>, values: impl IntoIterator<Item = T>) {
    list.clear();
    list.extend(values);
}

/// One value so many times in the storage of a list.
pub(crate) fn reset<T: Clone>(list: &mut Vec<T>, count: usize, value: T) {
    list.clear();
    list.resize(count, value);
}

/// The entry with this key of a list by rising keys, made where it is new.
pub(crate) fn entry<'a, T, K: Ord>(
    list: &'a mut Vec<T>,
    key: &K,
    key_of: impl Fn(&T) -> K,
    make: impl FnOnce() -> T,
) -> &'a mut T {
    let at = list.binary_search_by_key(key, key_of).unwrap_or_else(|at| {
        list.insert(at, make());
        at
    });
    &mut list[at]
}
