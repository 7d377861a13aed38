//! A place for one thing: whoever puts replaces, whoever takes gets the newest.
//!
//! With a value in the making on one side and one in use on the other this is a triple buffer.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// See the module.
#[derive(Debug)]
pub struct Latest<T> {
    slot: Mutex<Slot<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct Slot<T> {
    value: Option<T>,
    closed: bool,
}

impl<T> Default for Latest<T> {
    fn default() -> Self {
        Self {
            slot: Mutex::new(Slot {
                value: None,
                closed: false,
            }),
            changed: Condvar::new(),
        }
    }
}

impl<T> Latest<T> {
    fn slot(&self) -> MutexGuard<'_, Slot<T>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a value; gives back the one that nobody took.
    pub fn put(&self, value: T) -> Option<T> {
        let before = self.slot().value.replace(value);
        self.changed.notify_all();
        before
    }

    /// Takes the value, if there is a new one.
    pub fn take(&self) -> Option<T> {
        self.slot().value.take()
    }

    /// Whether a value waits.
    pub fn is_full(&self) -> bool {
        self.slot().value.is_some()
    }

    /// Waits for a value and takes it; `None` once closed.
    pub fn wait(&self) -> Option<T> {
        let mut slot = self.slot();
        loop {
            if slot.closed {
                return None;
            }
            if let Some(value) = slot.value.take() {
                return Some(value);
            }
            slot = self.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Lets everyone who waits go, now and later.
    pub fn close(&self) {
        self.slot().closed = true;
        self.changed.notify_all();
    }

    /// Whether [`Self::close`] was called.
    pub fn is_closed(&self) -> bool {
        self.slot().closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn the_newest_value_wins_and_is_taken_once() {
        let latest = Latest::default();
        assert_eq!(latest.put(1), None);
        assert_eq!(latest.put(2), Some(1));
        assert!(latest.is_full());
        assert_eq!((latest.take(), latest.take()), (Some(2), None));
    }

    #[test]
    fn closing_lets_a_waiter_go() {
        let latest = Arc::new(Latest::<u8>::default());
        let waiter = {
            let latest = Arc::clone(&latest);
            std::thread::spawn(move || latest.wait())
        };
        latest.close();
        assert_eq!(waiter.join().unwrap(), None);
        assert!(latest.is_closed());
    }
}
