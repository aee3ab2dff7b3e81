//! Things by numbers that stay as long as the thing is there. The number of one that has gone is given to the next.

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct Slots<T>(Vec<Option<T>>);

impl<T> Slots<T> {
    /// Nothing, with room for so many.
    pub(super) fn with_capacity(capacity: usize) -> Self {
        Self(Vec::with_capacity(capacity))
    }

    /// Adds `thing`; the lowest number that is free is its own.
    pub(super) fn insert(&mut self, thing: T) -> usize {
        let free = self.0.iter().position(Option::is_none);
        let number = free.unwrap_or(self.0.len());
        match self.0.get_mut(number) {
            Some(place) => *place = Some(thing),
            None => self.0.push(Some(thing)),
        }
        number
    }

    /// Takes the thing of this number out.
    pub(super) fn remove(&mut self, number: usize) -> Option<T> {
        self.0.get_mut(number)?.take()
    }

    pub(super) fn get(&self, number: usize) -> Option<&T> {
        self.0.get(number)?.as_ref()
    }

    pub(super) fn get_mut(&mut self, number: usize) -> Option<&mut T> {
        self.0.get_mut(number)?.as_mut()
    }

    /// All numbers are below this one.
    pub(super) fn end(&self) -> usize {
        self.0.len()
    }

    /// What there is, with its numbers, in their order.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &T)> {
        self.0.iter().enumerate().filter_map(|(number, place)| Some((number, place.as_ref()?)))
    }

    /// What there is, to be changed.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.iter_mut().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_stays_and_one_that_is_free_is_given_again() {
        let mut slots = Slots::with_capacity(2);
        assert_eq!(['a', 'b', 'c'].map(|thing| slots.insert(thing)), [0, 1, 2]);
        assert_eq!((slots.remove(1), slots.remove(1), slots.remove(9)), (Some('b'), None, None));
        assert_eq!((slots.get(0), slots.get(1), slots.get(2)), (Some(&'a'), None, Some(&'c')));
        assert_eq!(slots.iter().collect::<Vec<_>>(), [(0, &'a'), (2, &'c')]);
        assert_eq!([slots.insert('d'), slots.insert('e')], [1, 3]);
        assert_eq!(slots.end(), 4);
    }
}
