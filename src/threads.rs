//! Work on several threads. The results do not depend on the number of threads. Each part of the work is computed
//! independently of the other parts. The results of the parts are combined in a fixed order.

use std::fmt;
use std::sync::Arc;

/// Threads that share work; a single one by default. Clones share the threads.
#[derive(Clone, Default)]
pub struct Threads(Option<Arc<rayon::ThreadPool>>);

impl fmt::Debug for Threads {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Threads({})", self.count())
    }
}

impl Threads {
    /// Starts `count` threads, at least one.
    pub fn new(count: usize) -> Threads {
        let pool = (count > 1).then(|| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(count);
            Arc::new(pool.build().expect("threads can be started"))
        });
        Threads(pool)
    }

    /// Returns the number of threads.
    pub fn count(&self) -> usize {
        self.0.as_ref().map_or(1, |pool| pool.current_num_threads())
    }

    /// Calls `work` for each item.
    pub fn each<T: Send>(&self, items: impl IntoIterator<Item = T>, work: impl Fn(T) + Sync) {
        let Some(pool) = &self.0 else {
            return items.into_iter().for_each(work);
        };
        let work = &work;
        pool.in_place_scope(|scope| {
            for item in items {
                scope.spawn(move |_| work(item));
            }
        });
    }

    /// Returns the result of each item, in the order of the items.
    pub fn map<T: Send, R: Send>(
        &self,
        items: impl IntoIterator<Item = T>,
        work: impl Fn(T) -> R + Sync,
    ) -> Vec<R> {
        if self.0.is_none() {
            return items.into_iter().map(work).collect();
        }
        let items: Vec<T> = items.into_iter().collect();
        let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
        self.each(results.iter_mut().zip(items), |(result, item)| {
            *result = Some(work(item));
        });
        let results = results.into_iter();
        results
            .map(|result| result.expect("each item has been worked on"))
            .collect()
    }

    /// Computes both results.
    pub fn both<A: Send, B: Send>(
        &self,
        first: impl FnOnce() -> A + Send,
        second: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        match &self.0 {
            None => (first(), second()),
            Some(pool) => pool.install(|| rayon::join(first, second)),
        }
    }

    /// Runs `work` on one of the threads, from which work is shared with the others without delay.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.0 {
            None => work(),
            Some(pool) => pool.install(work),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_items() {
        let squares: Vec<usize> = (0..100).map(|k| k * k).collect();
        for count in [1, 2, 3, 8] {
            let threads = Threads::new(count);
            assert_eq!(threads.count(), count);
            assert_eq!(threads.map(0..100, |k| k * k), squares, "{count} threads");
            // Nested work.
            let sums = threads.map(0..7, |k| threads.map(0..k, |i| i).iter().sum::<usize>());
            assert_eq!(sums, [0, 0, 1, 3, 6, 10, 15], "{count} threads");
            assert_eq!(threads.both(|| 1, || 2), (1, 2));
        }
    }
}
