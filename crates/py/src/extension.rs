//! Forces and behaviours written in Python (the thesis's extensibility, §IV.A.2).
//!
//! A force is an object of the world like one written in Rust: it is asked at every evaluation of every integrator's stages. A behaviour is asked once
//! a frame, before it, and what it does acts during that frame. Both see a [`View`]. What Python raises is kept, and handed to the caller of the step
//! with its traceback; the frame is run to its end without that force, and then the world is put back to where it was before.

use crate::errors::{Error, Result};
use crate::shared::Inner;
use crate::view::{Layout, View};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard};
use tumble::core::{ForceGenerator, Forces, Mode, Object, ObjectId, Span, WorldView, Wrench};

/// A Python object that is called, which rows are whose, and what it raised.
struct Code {
    name: String,
    object: Py<PyAny>,
    layout: Mutex<Option<Arc<Layout>>>,
    raised: Mutex<Option<PyErr>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Code {
    fn new(name: &str, object: &Bound<'_, PyAny>) -> Code {
        Code { name: name.into(), object: object.clone().unbind(), layout: Mutex::default(), raised: Mutex::default() }
    }

    /// For a fork of the world: what the object's own `fork` answers. What that raises is kept like what a call raises.
    fn fork(&self) -> Code {
        Python::attach(|py| {
            let (object, raised) = match self.object.call_method0(py, "fork") {
                Ok(object) => (object, None),
                Err(error) => (self.object.clone_ref(py), Some(error)),
            };
            Code { name: self.name.clone(), object, layout: Mutex::default(), raised: Mutex::new(raised) }
        })
    }

    fn layout(&self, world: &WorldView) -> Arc<Layout> {
        let mut kept = lock(&self.layout);
        match &*kept {
            Some(layout) if layout.fits(world) => layout.clone(),
            _ => kept.insert(Arc::new(Layout::of(world))).clone(),
        }
    }

    /// Calls a method with a view; what was added to it, by row.
    fn call(&self, world: &WorldView, method: &str, rows: impl FnOnce(Python<'_>, &Layout) -> Result<Option<Py<PyAny>>>) -> Result<Vec<Wrench>> {
        let layout = self.layout(world);
        Python::attach(|py| {
            let view = Bound::new(py, View::new(py, world, &layout)?)?;
            let object = self.object.bind(py);
            let outcome = match rows(py, &layout)? {
                Some(rows) => object.call_method1(method, (&view, rows)),
                None => object.call_method1(method, (&view,)),
            };
            let wrenches = view.get().end(py, &self.name);
            match outcome?.is_none() {
                true => wrenches,
                false => Err(Error::value(format!("'{}': `{method}` must return None; add what it does to view.force and view.torque", self.name))),
            }
        })
    }
}

/// A force written in Python, as the world holds it.
struct PythonForce {
    code: Code,
}

impl Object for PythonForce {
    fn name(&self) -> &str {
        &self.code.name
    }

    fn fork(&self) -> Box<dyn Object> {
        Box::new(PythonForce { code: self.code.fork() })
    }

    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for PythonForce {
    fn apply(&self, _me: &Span, view: &WorldView, out: &mut Forces) {
        // after an error the rest of the frame is of no use
        if lock(&self.code.raised).is_some() {
            return;
        }
        match self.code.call(view, "apply", |_, _| Ok(None)) {
            Ok(wrenches) => {
                for (sum, wrench) in out.wrenches.iter_mut().zip(wrenches) {
                    sum.force += wrench.force;
                    sum.torque += wrench.torque;
                }
            }
            Err(error) => *lock(&self.code.raised) = Some(error.into()),
        }
    }
}

/// A behaviour and the bodies it was given.
struct Attached {
    code: Code,
    bodies: Vec<ObjectId>,
}

/// The forces and behaviours of one world.
#[derive(Default)]
pub struct Extension {
    forces: Vec<ObjectId>,
    behaviours: Vec<Attached>,
}

impl Extension {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.forces.is_empty() && self.behaviours.is_empty()
    }

    /// For a fork of the world.
    pub fn fork(&self) -> Extension {
        let attached = |a: &Attached| Attached { code: a.code.fork(), bodies: a.bodies.clone() };
        Extension { forces: self.forces.clone(), behaviours: self.behaviours.iter().map(attached).collect() }
    }
}

impl Inner {
    /// What a callback raised since it was last asked.
    pub fn take_raised(&self) -> Result<()> {
        let forces = self.extension.forces.iter().filter_map(|&id| self.world.get::<PythonForce>(id)).map(|force| &force.code);
        let codes = forces.chain(self.extension.behaviours.iter().map(|b| &b.code));
        let mut raised: Vec<PyErr> = codes.filter_map(|code| lock(&code.raised).take()).collect();
        if raised.is_empty() { Ok(()) } else { Err(raised.swap_remove(0).into()) }
    }

    /// One frame with behaviours before it and forces in it. Where one raises, the world is as it was before.
    pub fn extended_frame(&mut self) -> Result<()> {
        // what could not be forked
        self.take_raised()?;
        let before = self.world.save();
        if let Err(error) = self.behave() {
            self.world.restore(&before)?;
            return Err(error);
        }
        let outcome = self.frame();
        if let Err(error) = self.take_raised() {
            self.world.restore(&before)?;
            return Err(error);
        }
        outcome
    }

    fn behave(&mut self) -> Result<()> {
        for Attached { code, bodies } in &self.extension.behaviours {
            let view = self.world.view();
            let layout = code.layout(&view);
            let rows: Vec<i64> = bodies.iter().filter_map(|&id| layout.rows(id)).flatten().map(|row| row as i64).collect();
            if rows.is_empty() {
                continue;
            }
            let array = |py: Python<'_>, _: &Layout| Ok(Some(numpy::PyArray1::from_slice(py, &rows).into_any().unbind()));
            let wrenches = code.call(&view, "act", array)?;
            for (row, wrench) in wrenches.iter().enumerate().filter(|(_, wrench)| **wrench != Wrench::default()) {
                let Some((id, part, _)) = layout.owner(row) else { continue };
                let Some(point) = self.world.site(id, part).map(|site| site.position()) else { continue };
                self.world.apply_force(id, part, wrench.force, &point)?;
                self.world.apply_torque(id, part, wrench.torque)?;
            }
        }
        Ok(())
    }

    /// Adds a force; it must have `apply` and `fork`.
    pub fn add_force(&mut self, name: &str, object: &Bound<'_, PyAny>) -> Result<()> {
        self.check_new(name)?;
        let id = self.world.add_boxed(Box::new(PythonForce { code: Code::new(name, object) }), Mode::Dynamic)?;
        self.extension.forces.push(id);
        Ok(())
    }

    /// Adds a behaviour of some bodies; it must have `act` and `fork`.
    pub fn add_behaviour(&mut self, name: &str, object: &Bound<'_, PyAny>, bodies: Vec<ObjectId>) -> Result<()> {
        self.check_new(name)?;
        if bodies.is_empty() {
            return Err(Error::value(format!("behaviour '{name}': wanted at least one body")));
        }
        self.extension.behaviours.push(Attached { code: Code::new(name, object), bodies });
        Ok(())
    }

    fn check_new(&self, name: &str) -> Result<()> {
        match self.world.find(name).is_some() || self.extension.behaviours.iter().any(|b| b.code.name == name) {
            true => Err(tumble::core::WorldError::DuplicateName(name.into()).into()),
            false => Ok(()),
        }
    }

    /// Removes a force or a behaviour; whether there was one of that name.
    pub fn remove_extension(&mut self, name: &str) -> Result<bool> {
        if let Some(at) = self.extension.behaviours.iter().position(|b| b.code.name == name) {
            self.extension.behaviours.remove(at);
            return Ok(true);
        }
        let Some(id) = self.world.find(name).filter(|id| self.extension.forces.contains(id)) else { return Ok(false) };
        self.world.remove(id)?;
        self.extension.forces.retain(|other| *other != id);
        Ok(true)
    }

    /// Names and objects of the forces, then of the behaviours, in the order of adding.
    pub fn extensions(&self, py: Python<'_>) -> [Vec<(String, Py<PyAny>)>; 2] {
        let pair = |code: &Code| (code.name.clone(), code.object.clone_ref(py));
        let forces = self.extension.forces.iter().filter_map(|&id| self.world.get::<PythonForce>(id)).map(|force| pair(&force.code));
        [forces.collect(), self.extension.behaviours.iter().map(|b| pair(&b.code)).collect()]
    }
}
