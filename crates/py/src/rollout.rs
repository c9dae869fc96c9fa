//! Many futures of one world at once: forks, each under controls of its own, on all cores.

use crate::bodies::body_ids;
use crate::convert::{Numbers, room, shown};
use crate::errors::{Error, Result, caught};
use crate::inner::Inner;
use crate::interrupt::Stop;
use crate::pool;
use pyo3::exceptions::PyRecursionError;
use rayon::prelude::*;
use std::cell::Cell;
use std::sync::Mutex;
use tumble::dynamics::ObjectId;

/// Most numbers that one call returns: 4 GiB of them.
const MOST: usize = 1 << 29;

/// Rollouts within forces within rollouts, and so on, at most: a force that rolls out the world it acts in would go on for ever.
const DEEPEST: usize = 4;

thread_local! {
    /// How many rollouts this thread is in.
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

/// What is asked for.
pub struct Plan {
    /// Forks.
    pub count: usize,
    /// Frames of each.
    pub frames: usize,
    /// Every how many frames the state is kept.
    pub every: usize,
    /// Articulated bodies and their freedoms: a row of controls is one after the other.
    pub driven: Vec<(ObjectId, usize)>,
    /// `count · frames · width` generalized forces.
    controls: Vec<f64>,
    /// How many rollouts it is in, with itself.
    depth: usize,
    /// One state for all forks, one for each, or none: where the world is.
    states: Option<Numbers>,
}

impl Plan {
    /// For some articulated bodies, or all. Checks shapes against each other and the world.
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
                "a force that rolls out a world from within a rollout, more than {DEEPEST} deep"
            ))
            .into());
        }
        let all = || body_ids(&inner.world).into_iter().filter(|id| inner.robots.contains_key(id)).collect();
        let freedoms = |id: ObjectId| {
            inner
                .robots
                .get(&id)
                .map(|robot| (id, robot.dof()))
                .ok_or_else(|| Error::value("controls are of articulations"))
        };
        let driven = asked.unwrap_or_else(all).into_iter().map(freedoms).collect::<Result<Vec<_>>>()?;
        let width: usize = driven.iter().map(|(_, dof)| dof).sum();
        let [count, frames, got] = controls.shape[..] else {
            return Err(Error::value(format!(
                "controls: wanted shape (forks, steps, {width}), and got {}",
                shown(&controls.shape)
            )));
        };
        if got != width {
            let why = "as many as the articulations have freedoms";
            return Err(Error::value(format!(
                "controls: wanted {width} numbers a step, {why}, and got shape {}",
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
                "states: wanted shape ({x},) or ({count}, {x}), and got {}",
                shown(&states.shape)
            )));
        }
        let numbers = count.checked_mul(frames / every).and_then(|n| n.checked_mul(x.max(1)));
        if numbers.is_none_or(|n| n > MOST) {
            return Err(Error::value(format!(
                "{count} forks of {frames} steps have more than {MOST} numbers; keep fewer with `every`"
            )));
        }
        Ok(Plan { depth, count, frames, every, driven, controls: controls.data, states })
    }

    fn width(&self) -> usize {
        self.driven.iter().map(|(_, dof)| dof).sum()
    }

    /// Where a fork starts, if not where the world is.
    fn start(&self, fork: usize) -> Option<&[f64]> {
        let Numbers { shape, data } = self.states.as_ref()?;
        match shape[..] {
            [_, x] => Some(&data[fork * x..(fork + 1) * x]),
            _ => Some(data),
        }
    }

    /// Runs all forks: the states after every `every` frames, fork by fork. `world` is forked again for each, so that only as many exist at
    /// once as there are threads.
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
        // the first fork that failed, whichever was first in time
        match world.extension.is_empty() {
            true => {
                let template = Mutex::new(world);
                let each = |(fork, out): (usize, &mut [f64])| {
                    stop.check()?;
                    let own = template.lock().map_err(|_| Error::Broken)?.fork();
                    caught(|| self.fork(own, fork, out, stop))
                };
                pool.install(|| out.par_chunks_mut(kept).enumerate().map(each).collect::<Vec<Result<()>>>())
                    .into_iter()
                    .collect::<Result<()>>()?;
            }
            // a fork runs code in Python, which may wait for the threads of the pool: none of them may wait for it
            false => {
                let few = 4 * pool.current_num_threads();
                for (first, out) in out.chunks_mut(few * kept).enumerate().map(|(k, out)| (k * few, out)) {
                    stop.check()?;
                    let own: Vec<Mutex<Option<Inner>>> =
                        (0..out.len() / kept).map(|_| Mutex::new(Some(world.fork()))).collect();
                    let each = |(k, out): (usize, &mut [f64])| {
                        let own = own[k].lock().map_err(|_| Error::Broken)?.take().ok_or(Error::Broken)?;
                        caught(|| self.fork(own, first + k, out, stop))
                    };
                    pool.install(|| out.par_chunks_mut(kept).enumerate().map(each).collect::<Vec<Result<()>>>())
                        .into_iter()
                        .collect::<Result<()>>()?;
                }
            }
        }
        Ok(out)
    }

    fn fork(&self, own: Inner, fork: usize, out: &mut [f64], stop: &Stop) -> Result<()> {
        // a thread that waits may do another's work meanwhile
        let before = DEPTH.replace(self.depth);
        let outcome = stop.within(|| self.go(own, fork, out, stop));
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
            let mut row = &controls[frame * width..(frame + 1) * width];
            for &(id, dof) in &self.driven {
                let (own_row, rest) = row.split_at(dof);
                own.efforts.insert(id, own_row.to_vec());
                row = rest;
            }
            own.step().map_err(|source| Error::Fork { fork, frame, source: Box::new(source) })?;
            if (frame + 1) % self.every == 0 {
                let at = ((frame + 1) / self.every - 1) * size;
                out[at..at + size].copy_from_slice(own.world.state());
            }
        }
        Ok(())
    }
}
