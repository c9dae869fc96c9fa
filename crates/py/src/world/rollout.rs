//! Rollouts: many forks of one world, each with its own controls, on all cores.

use crate::arrays::convert::{Numbers, room, shown};
use crate::batch::crew::each;
use crate::errors::{Error, Result};
use crate::interrupt::Stop;
use crate::objects::place::body_ids;
use crate::pool;
use crate::world::inner::Inner;
use pyo3::exceptions::PyRecursionError;
use std::cell::Cell;
use std::sync::Mutex;
use tumble::dynamics::ObjectId;

/// Largest count of numbers that one call returns: 4 GiB.
const MAX_NUMBERS: usize = 1 << 29;

/// Largest depth of nested rollouts. A force that rolls out the world it acts in would recurse
/// forever.
const DEEPEST: usize = 4;

thread_local! {
    /// Number of rollouts that this thread is in.
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

/// The arguments of a rollout, checked.
pub struct Plan {
    /// Forks.
    pub count: usize,
    /// Frames of each.
    pub frames: usize,
    /// Interval in frames at which the state is kept.
    pub every: usize,
    /// Articulated bodies and their degrees of freedom. A row of controls has those of one after
    /// the other.
    pub driven: Vec<(ObjectId, usize)>,
    /// `count · frames · width` generalized forces.
    controls: Vec<f64>,
    /// Depth of nesting, including this rollout.
    depth: usize,
    /// One initial state for all forks, one for each, or none for that of the world.
    states: Option<Numbers>,
}

impl Plan {
    /// Checks shapes against each other and the world. `asked`: the articulated bodies, by default
    /// all.
    pub fn new(
        inner: &Inner,
        asked: Option<Vec<ObjectId>>,
        controls: Numbers,
        states: Option<Numbers>,
        every: usize,
    ) -> Result<Plan> {
        let depth = DEPTH.get() + 1;
        if depth > DEEPEST {
            return Err(PyRecursionError::new_err(format!(
                "rollouts are nested more than {DEEPEST} deep by forces that roll out their world"
            ))
            .into());
        }
        let all = || body_ids(&inner.world).into_iter().filter(|id| inner.robots.contains_key(id)).collect();
        let dofs = |id: ObjectId| {
            inner
                .robots
                .get(&id)
                .map(|robot| (id, robot.dof()))
                .ok_or_else(|| Error::value("controls are for articulations only"))
        };
        let driven = asked.unwrap_or_else(all).into_iter().map(dofs).collect::<Result<Vec<_>>>()?;
        let width: usize = driven.iter().map(|(_, dof)| dof).sum();
        let [count, frames, got] = controls.shape[..] else {
            return Err(Error::value(format!(
                "controls: expected shape (forks, steps, {width}), got {}",
                shown(&controls.shape)
            )));
        };
        if got != width {
            let why = "one for each degree of freedom of the articulations";
            return Err(Error::value(format!(
                "controls: expected {width} numbers per step, {why}, got shape {}",
                shown(&controls.shape)
            )));
        }
        if every == 0 || frames % every != 0 {
            return Err(Error::value(format!("every is {every}; it must divide the {frames} steps")));
        }
        let x = inner.world.state().len();
        if let Some(states) = &states
            && states.shape != [x]
            && states.shape != [count, x]
        {
            return Err(Error::value(format!(
                "states: expected shape ({x},) or ({count}, {x}), got {}",
                shown(&states.shape)
            )));
        }
        let numbers = count.checked_mul(frames / every).and_then(|n| n.checked_mul(x.max(1)));
        if numbers.is_none_or(|n| n > MAX_NUMBERS) {
            return Err(Error::value(format!(
                "{count} forks of {frames} steps have more than {MAX_NUMBERS} numbers; reduce them with `every`"
            )));
        }
        Ok(Plan { depth, count, frames, every, driven, controls: controls.data, states })
    }

    fn width(&self) -> usize {
        self.driven.iter().map(|(_, dof)| dof).sum()
    }

    /// Returns the initial state of a fork, if it is not that of the world.
    fn start(&self, fork: usize) -> Option<&[f64]> {
        let Numbers { shape, data } = self.states.as_ref()?;
        match shape[..] {
            [_, x] => Some(&data[fork * x..(fork + 1) * x]),
            _ => Some(data),
        }
    }

    /// Runs all forks and returns the states after every `every` frames, fork by fork. `world` is
    /// forked when a fork starts, so there are only as many at once as threads.
    pub fn run(&self, world: Inner, threads: Option<usize>, stop: &Stop) -> Result<Vec<f64>> {
        let kept = self.frames / self.every * world.world.state().len();
        let mut out = room(self.count * kept, "states")?;
        out.resize(self.count * kept, 0.0);
        if out.is_empty() {
            return Ok(out);
        }
        let pool = match threads {
            None => pool::shared()?,
            Some(threads) => pool::of(threads)?,
        };
        // Returns the error of the fork with the lowest number, whichever failed first.
        match world.extension.is_empty() {
            true => {
                let template = Mutex::new(world);
                let mut chunks: Vec<&mut [f64]> = out.chunks_mut(kept).collect();
                let outcomes = each(&pool, stop, &mut chunks, |fork, out| {
                    let own = template.lock().map_err(|_| Error::Broken)?.fork();
                    self.fork(own, fork, out, stop)
                });
                outcomes.into_iter().collect::<Result<()>>()?;
            }
            // A fork runs Python code, which may wait for threads of the pool, so no thread of the
            // pool may wait for it.
            false => {
                let few = 4 * pool.current_num_threads();
                for (first, out) in out.chunks_mut(few * kept).enumerate().map(|(k, out)| (k * few, out)) {
                    stop.check()?;
                    let fork = |out| (Some(world.fork()), out);
                    let mut forks: Vec<(Option<Inner>, &mut [f64])> = out.chunks_mut(kept).map(fork).collect();
                    let outcomes = each(&pool, stop, &mut forks, |k, (own, out)| {
                        let own = own.take().ok_or(Error::Broken)?;
                        self.fork(own, first + k, out, stop)
                    });
                    outcomes.into_iter().collect::<Result<()>>()?;
                }
            }
        }
        Ok(out)
    }

    fn fork(&self, own: Inner, fork: usize, out: &mut [f64], stop: &Stop) -> Result<()> {
        // A waiting thread may do another fork's work meanwhile.
        let before = DEPTH.replace(self.depth);
        let outcome = self.go(own, fork, out, stop);
        DEPTH.set(before);
        outcome
    }

    fn go(&self, mut own: Inner, fork: usize, out: &mut [f64], stop: &Stop) -> Result<()> {
        if let Some(start) = self.start(fork) {
            own.write_state(&[start.len()], start)?;
        }
        let (width, size) = (self.width(), own.world.state().len());
        let controls = &self.controls[fork * self.frames * width..(fork + 1) * self.frames * width];
        for frame in 0..self.frames {
            stop.check()?;
            own.set_efforts(self.driven.iter().copied(), &controls[frame * width..(frame + 1) * width]);
            own.step().map_err(|source| Error::Fork { fork, frame, source: Box::new(source) })?;
            if (frame + 1) % self.every == 0 {
                let at = ((frame + 1) / self.every - 1) * size;
                out[at..at + size].copy_from_slice(own.world.state());
            }
        }
        Ok(())
    }
}
