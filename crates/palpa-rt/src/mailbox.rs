//! Passes the latest value from one thread to another, through three slots that never move.
//!
//! ```text
//! writer's slot  ──publish──►  middle slot  ──take──►  reader's slot
//! ```
//! Publishing and taking each swap an index with the middle one in a single atomic exchange. So
//! neither side ever waits or retries, and a value of any size crosses without a copy. A value that
//! is overwritten before it was taken is lost. Proved under loom; the command is in the
//! documentation of the crate.

#[cfg(loom)]
use loom::{
    cell::UnsafeCell,
    sync::{Arc, atomic::AtomicU8},
};
#[cfg(not(loom))]
use std::{
    cell::UnsafeCell,
    sync::{Arc, atomic::AtomicU8},
};
use std::{fmt, sync::atomic::Ordering};

/// Flag on the middle index: the value in that slot has not been taken yet.
const NEW: u8 = 4;
const INDEX: u8 = 3;

struct Shared<T> {
    slots: [UnsafeCell<Box<T>>; 3],
    middle: AtomicU8,
}

/// The end that writes.
pub struct Writer<T> {
    shared: Arc<Shared<T>>,
    slot: u8,
}

/// The end that reads.
pub struct Reader<T> {
    shared: Arc<Shared<T>>,
    slot: u8,
}

/// Makes a mailbox of three slots. Until something is published, the reader sees their initial
/// value.
///
/// The boxes were written before, so their memory pages exist and neither thread touches one for
/// the first time.
pub fn mailbox<T: Send>(slots: [Box<T>; 3]) -> (Writer<T>, Reader<T>) {
    let shared = Arc::new(Shared {
        slots: slots.map(UnsafeCell::new),
        middle: AtomicU8::new(1),
    });
    (
        Writer {
            shared: shared.clone(),
            slot: 0,
        },
        Reader { shared, slot: 2 },
    )
}

impl<T> Writer<T> {
    /// The slot to write to. It holds the value of two or three publications ago: overwrite
    /// everything that the reader uses.
    #[inline]
    pub fn slot(&mut self) -> &mut T {
        self.shared.get_mut(self.slot)
    }

    /// Makes the slot the latest value, and takes another slot for the next one.
    #[inline]
    pub fn publish(&mut self) {
        let old = self.shared.middle.swap(self.slot | NEW, Ordering::AcqRel);
        self.slot = old & INDEX;
    }
}

impl<T> Reader<T> {
    /// Whether something was published since the last [`Reader::take`].
    #[inline]
    pub fn is_newer(&self) -> bool {
        self.shared.middle.load(Ordering::Relaxed) & NEW != 0
    }

    /// Makes the latest value the current one. Returns whether there was a newer one.
    #[inline]
    pub fn take(&mut self) -> bool {
        if !self.is_newer() {
            return false;
        }
        let old = self.shared.middle.swap(self.slot, Ordering::AcqRel);
        self.slot = old & INDEX;
        true
    }

    /// The value that was taken last.
    #[inline]
    pub fn current(&self) -> &T {
        self.shared.get(self.slot)
    }
}

impl<T> fmt::Debug for Writer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Writer").finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for Reader<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reader").finish_non_exhaustive()
    }
}

/// The only unsafe code of this crate. Each slot belongs to the writer, to the reader, or to
/// neither.
#[expect(
    unsafe_code,
    reason = "a slot is shared between two threads; who holds it is in an atomic index"
)]
mod slots {
    use super::{INDEX, Shared};

    // SAFETY: a slot is reached only through an index. The three indices (writer's, middle,
    // reader's) start as 0, 1, 2 and change only by exchange, so no two are ever equal; the
    // exchanges are acquire and release, so whoever gets an index sees all that was written to its
    // slot. `T` crosses threads, hence `Send`; it is never seen by two at once.
    unsafe impl<T: Send> Sync for Shared<T> {}
    // SAFETY: as above; loom's cell is not `Send` by itself.
    unsafe impl<T: Send> Send for Shared<T> {}

    impl<T> Shared<T> {
        #[cfg(not(loom))]
        #[inline]
        #[expect(
            clippy::mut_from_ref,
            reason = "the borrow of the writer, which owns the index, is exclusive"
        )]
        pub(super) fn get_mut(&self, slot: u8) -> &mut T {
            let cell = &self.slots[usize::from(slot & INDEX) % 3];
            // SAFETY: only the writer calls this, with its own index and itself borrowed
            // exclusively.
            unsafe { &mut *cell.get() }
        }

        #[cfg(not(loom))]
        #[inline]
        pub(super) fn get(&self, slot: u8) -> &T {
            let cell = &self.slots[usize::from(slot & INDEX) % 3];
            // SAFETY: only the reader calls this, with its own index; while that borrow lasts it
            // cannot take another.
            unsafe { &*cell.get() }
        }

        // Under loom every access is checked by the cell against all others that may be concurrent.
        #[cfg(loom)]
        #[expect(
            clippy::mut_from_ref,
            reason = "the borrow of the writer, which owns the index, is exclusive"
        )]
        pub(super) fn get_mut(&self, slot: u8) -> &mut T {
            let cell = &self.slots[usize::from(slot & INDEX) % 3];
            // SAFETY: as without loom.
            cell.with_mut(|value| unsafe { &mut **value })
        }

        #[cfg(loom)]
        pub(super) fn get(&self, slot: u8) -> &T {
            let cell = &self.slots[usize::from(slot & INDEX) % 3];
            // SAFETY: as without loom.
            cell.with(|value| unsafe { &**value })
        }
    }
}

#[cfg(all(test, loom))]
mod proof {
    use super::mailbox;
    use loom::thread;

    /// Tests all interleavings of three publications with three takes: each value read is complete
    /// and never older than the one before, and the last value arrives once the writer is done.
    #[test]
    fn what_is_taken_is_whole_and_never_older() {
        loom::model(|| {
            let (mut writer, mut reader) = mailbox([(); 3].map(|()| Box::new([0_u64; 2])));
            let writing = thread::spawn(move || {
                for n in 1..=3 {
                    let slot = writer.slot();
                    slot[0] = n;
                    slot[1] = n;
                    writer.publish();
                }
            });
            let mut last = 0;
            for _ in 0..3 {
                let was_new = reader.take();
                let [a, b] = *reader.current();
                assert_eq!(a, b);
                assert!(if was_new { a > last } else { a == last });
                last = a;
            }
            writing.join().unwrap();
            reader.take();
            assert_eq!(*reader.current(), [3, 3]);
            assert!(!reader.is_newer());
        });
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::mailbox;
    use std::thread;

    #[test]
    fn large_values_cross_whole_and_in_order() {
        const N: usize = 2000;
        const LAST: u64 = 20_000;
        let (mut writer, mut reader) = mailbox([(); 3].map(|()| Box::new([0_u64; N])));
        let writing = thread::spawn(move || {
            for n in 1..=LAST {
                writer.slot().fill(n);
                writer.publish();
            }
        });
        let mut last = 0;
        let mut n_taken = 0_u32;
        while last < LAST {
            if reader.take() {
                let first = reader.current()[0];
                assert!(first > last, "{first} came after {last}");
                assert!(
                    reader.current().iter().all(|v| *v == first),
                    "torn at {first}"
                );
                last = first;
                n_taken += 1;
            }
        }
        writing.join().unwrap();
        assert!(n_taken > 0 && !reader.take());
    }
}
