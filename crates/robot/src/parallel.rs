//! A parallel map, on as many threads as there are processors.

use std::thread;

/// Maximum number of threads.
const MOST: usize = 8;

/// Returns the result of `of` for each item, in their order. The number of threads does not affect the results.
pub fn each<T: Sync, R: Send>(items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = thread::available_parallelism().map_or(1, usize::from).min(MOST);
    let part = |items: &[T]| items.iter().map(&of).collect::<Vec<R>>();
    thread::scope(|scope| {
        let part = &part;
        let parts = items.chunks(items.len().div_ceil(threads).max(1));
        let begun: Vec<_> =
            parts.map(|items| (items, thread::Builder::new().spawn_scoped(scope, move || part(items)))).collect();
        // If no thread can be started, the current thread does the work.
        let ended = begun.into_iter().flat_map(|(items, begun)| match begun {
            Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(_) => part(items),
        });
        ended.collect()
    })
}
