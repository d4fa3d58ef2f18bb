//! The thread that computes error bars beside the loop.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use anyhow::Context as _;
use palpa_rt::{Granted, Priority, Wish};

use super::error_bar::{LiveBar, Moment, NoBar, probe};
use crate::Prepared;

const NAME: &str = "palpa-probe";
/// Every other thread goes first.
const AFTER_ALL: Wish = Wish {
    priority: Priority::Idle,
    core: None,
};

/// A thread that computes error bars of the live mesh, one at a time.
///
/// Static steps run in rayon's pools. This one has a single thread, so that the probes never use
/// more than one core, and only while it has nothing else to do. When dropped, it gives up what it does.
#[derive(Debug)]
pub struct Prober {
    pool: rayon::ThreadPool,
    granted: Granted,
    outbox: SyncSender<Result<LiveBar, NoBar>>,
    done: Receiver<Result<LiveBar, NoBar>>,
    /// Tells the job under way to give up; `None` without a job.
    gives_up: Option<Arc<AtomicBool>>,
}

impl Prober {
    /// Starts the thread.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn start() -> anyhow::Result<Self> {
        Self::start_as(AFTER_ALL)
    }

    /// As [`Self::start`], with other scheduling: a program that waits for a bar may want it on a busy machine too.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn start_as(wish: Wish) -> anyhow::Result<Self> {
        let (tell, told) = sync_channel(1);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .thread_name(|_| NAME.to_owned())
            .start_handler(move |_| {
                // Only the thread itself can request this. The receiver waits for it.
                let _ = tell.send(wish.ask(NAME));
            })
            .build()
            .context("no thread for error bars")?;
        let granted = told.recv().context("the thread for error bars ended")?;
        let (outbox, done) = sync_channel(1);
        Ok(Self {
            pool,
            granted,
            outbox,
            done,
            gives_up: None,
        })
    }

    /// The scheduling that the system granted.
    pub fn granted(&self) -> &Granted {
        &self.granted
    }

    /// Whether a bar is being computed.
    pub fn is_busy(&self) -> bool {
        self.gives_up.is_some()
    }

    /// Starts to compute a bar. Returns false, and does nothing, if one is being computed.
    pub fn begin(&mut self, prepared: &Arc<Prepared>, moment: Moment) -> bool {
        let prepared = Arc::clone(prepared);
        self.begin_job(move |goes_on| probe(&prepared, &moment, goes_on))
    }

    fn begin_job(
        &mut self,
        job: impl FnOnce(&dyn Fn() -> bool) -> Result<LiveBar, NoBar> + Send + 'static,
    ) -> bool {
        if self.is_busy() {
            return false;
        }
        let gives_up = Arc::new(AtomicBool::new(false));
        self.gives_up = Some(Arc::clone(&gives_up));
        let outbox = self.outbox.clone();
        self.pool.spawn(move || {
            let goes_on = || !gives_up.load(Ordering::Relaxed);
            let found = catch_unwind(AssertUnwindSafe(|| job(&goes_on)));
            // There is room for the result of the only job. Nobody may want it any more.
            let _ = outbox.send(found.unwrap_or(Err(NoBar::Panicked)));
        });
        true
    }

    /// The result of the last job, if it has ended.
    pub fn take(&mut self) -> Option<Result<LiveBar, NoBar>> {
        let found = self.done.try_recv().ok()?;
        self.gives_up = None;
        Some(found)
    }

    /// Waits for the result of the job under way; `None` if there is none.
    pub fn wait(&mut self) -> Option<Result<LiveBar, NoBar>> {
        self.gives_up.take()?;
        self.done.recv().ok()
    }

    /// Tells the job under way to give up. Its result still comes: mostly [`NoBar::Interrupted`].
    pub fn give_up(&self) {
        if let Some(gives_up) = &self.gives_up {
            gives_up.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for Prober {
    fn drop(&mut self) {
        self.give_up();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One that gets its share of the time however busy the machine is.
    fn prober() -> Prober {
        Prober::start_as(Wish::NORMAL).unwrap()
    }

    #[test]
    fn one_job_at_a_time_that_can_be_given_up() {
        let mut prober = prober();
        assert!(!prober.is_busy() && prober.take().is_none() && prober.wait().is_none());
        let until_given_up = |goes_on: &dyn Fn() -> bool| {
            while goes_on() {
                std::thread::yield_now();
            }
            Err(NoBar::Interrupted)
        };
        assert!(prober.begin_job(until_given_up));
        assert!(!prober.begin_job(until_given_up));
        assert!(prober.is_busy() && prober.take().is_none());
        prober.give_up();
        assert_eq!(prober.wait(), Some(Err(NoBar::Interrupted)));
        assert!(!prober.is_busy());
        // The next job is not given up.
        assert!(prober.begin_job(|goes_on| {
            assert!(goes_on());
            Err(NoBar::NoEquilibrium)
        }));
        assert_eq!(prober.wait(), Some(Err(NoBar::NoEquilibrium)));
    }

    #[test]
    fn it_runs_in_idle_time() {
        let prober = Prober::start().unwrap();
        let granted = prober.granted();
        assert_eq!((granted.wish, &granted.priority), (AFTER_ALL, &Ok(())));
    }

    #[test]
    fn a_panic_is_a_result_and_the_thread_goes_on() {
        let mut prober = prober();
        assert!(prober.begin_job(|_| panic!("on purpose")));
        assert_eq!(prober.wait(), Some(Err(NoBar::Panicked)));
        assert!(prober.begin_job(|_| Err(NoBar::NotTouching)));
        assert_eq!(prober.wait(), Some(Err(NoBar::NotTouching)));
    }

    #[test]
    fn the_thread_has_a_name_and_static_steps_stay_on_it() {
        let mut prober = prober();
        assert_eq!(prober.granted().thread, NAME);
        assert!(prober.begin_job(|_| {
            let name = || std::thread::current().name().map(str::to_owned);
            let names = rayon::join(name, || rayon::scope(|_| name()));
            assert_eq!(names, (Some(NAME.to_owned()), Some(NAME.to_owned())));
            Err(NoBar::NotTouching)
        }));
        assert_eq!(prober.wait(), Some(Err(NoBar::NotTouching)));
    }
}
