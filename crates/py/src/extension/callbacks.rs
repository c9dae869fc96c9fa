//! Forces, behaviors and callables written in Python (the thesis's extensibility, §IV.A.2).
//!
//! A force is an object of the world, like one written in Rust: it is evaluated in every stage of
//! every integrator. A behavior is called once before each frame, and its forces act during that
//! frame. Both get a [`View`](crate::extension::view::View). An exception from Python is kept and raised by the step with its
//! traceback. The frame runs to its end without that force, and then the world returns to its state
//! before the frame.

use crate::errors::{Error, Result};
use crate::extension::code::{Code, lock};
use crate::extension::intersect::PythonTest;
use crate::world::gc::Callable;
use crate::world::inner::Inner;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Arc;
use tumble::dynamics::{
    ForceGenerator, Forces, Intersect, Mode, Object, ObjectId, StateRange, World, WorldView, Wrench,
};

/// A force written in Python as an object of the world.
struct PythonForce {
    code: Code,
}

impl Clone for PythonForce {
    /// Copies the Python object, as a fork of the world requires.
    fn clone(&self) -> PythonForce {
        PythonForce { code: self.code.fork("apply") }
    }
}

impl Object for PythonForce {
    fn name(&self) -> &str {
        &self.code.name
    }

    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for PythonForce {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        // After an error the rest of the frame is discarded.
        if lock(&self.code.raised).is_some() {
            return;
        }
        let add = |part_index: usize, wrench: Wrench| {
            out.wrenches[part_index].force += wrench.force;
            out.wrenches[part_index].torque += wrench.torque;
        };
        if let Err(error) = self.code.call(view, "apply", None, add) {
            *lock(&self.code.raised) = Some(error.into());
        }
    }
}

/// Returns a force whose Python object is set later; `None` stands for it.
pub fn empty_force(name: &str) -> Box<dyn Object> {
    let nobody = Python::attach(|py| Arc::new(py.None()));
    Box::new(PythonForce { code: Code::of(name, nobody) })
}

/// Python objects by the name of the object of the world that calls them.
type Named = Vec<(String, Py<PyAny>)>;

/// A link, and the number of one of its shapes; of a compound that of its first part.
pub type OfLink = (String, usize);

/// The body of an intersection test, its object, and the link that has it.
type TestRecord = (String, Py<PyAny>, Option<OfLink>);

/// Names and objects of forces; names, objects and bodies of behaviors; callables of events; intersection tests of bodies and links.
pub type Extensions = (Named, Vec<(String, Py<PyAny>, Vec<String>)>, Named, Vec<TestRecord>);

/// The result of `__reduce__`: the function that makes the world, its arguments, and the state for
/// `__setstate__`.
pub type Reduced<'py> = (Bound<'py, PyAny>, (Bound<'py, PyBytes>,), Option<Extensions>);

/// A behavior and its bodies.
struct Attached {
    code: Code,
    bodies: Vec<ObjectId>,
}

/// A callable of an event.
struct Called {
    event: ObjectId,
    code: Code,
}

/// The intersection test of a body, or of a link of it.
struct Tested {
    body: ObjectId,
    link: Option<OfLink>,
    test: Arc<PythonTest>,
}

/// The callbacks of Python in one world: its forces and behaviors, the callables of events, and the intersection tests of bodies.
#[derive(Default)]
pub struct Extension {
    forces: Vec<ObjectId>,
    behaviors: Vec<Attached>,
    calls: Vec<Called>,
    tests: Vec<Tested>,
}

impl Extension {
    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.forces.is_empty() && self.behaviors.is_empty() && self.calls.is_empty() && self.tests.is_empty()
    }

    /// Returns the copy for a fork of the world, whose bodies get tests of their own.
    pub fn fork(&self, world: &mut World) -> Extension {
        let attached = |a: &Attached| Attached { code: a.code.fork("act"), bodies: a.bodies.clone() };
        let called = |c: &Called| Called { event: c.event, code: c.code.fork_callable() };
        let mut fork = Extension {
            forces: self.forces.clone(),
            behaviors: self.behaviors.iter().map(attached).collect(),
            calls: self.calls.iter().map(called).collect(),
            tests: Vec::new(),
        };
        for Tested { body, link, test } in &self.tests {
            let _ = fork.set_test(world, *body, link.clone(), Some(test.object.clone())); // as it was set here
        }
        fork
    }

    /// Gives a body of a world, or a link of it, an intersection test, or takes it.
    fn set_test(
        &mut self,
        world: &mut World,
        body: ObjectId,
        link: Option<OfLink>,
        object: Option<Callable>,
    ) -> Result<()> {
        let test = object.map(|object| Arc::new(PythonTest::new(object)));
        give(world, body, link.as_ref(), test.clone())?;
        self.tests.retain(|tested| tested.body != body || tested.link != link);
        self.tests.extend(test.map(|test| Tested { body, link, test }));
        Ok(())
    }

    /// Drops what belongs to a removed object.
    pub fn forget(&mut self, id: ObjectId) {
        self.calls.retain(|called| called.event != id);
        self.tests.retain(|tested| tested.body != id);
    }
}

/// Sets the intersection test of a body or of a link.
fn give(world: &mut World, body: ObjectId, link: Option<&OfLink>, test: Option<Arc<PythonTest>>) -> Result<()> {
    let test = test.map(|test| test as Arc<dyn Intersect>);
    match link {
        None => Ok(world.set_intersect(body, test)?),
        Some((link, shape)) => Ok(world.set_link_intersect(body, link, Some(*shape), test)?),
    }
}

impl Inner {
    /// Returns the exception that a callback raised since the last call, as an error.
    pub fn take_raised(&self) -> Result<()> {
        let forces =
            self.extension.forces.iter().filter_map(|&id| self.world.get::<PythonForce>(id)).map(|force| &force.code);
        let codes = forces.chain(self.extension.behaviors.iter().map(|b| &b.code));
        let codes = codes.chain(self.extension.calls.iter().map(|called| &called.code));
        let tests = self.extension.tests.iter().filter_map(|tested| tested.test.take_raised());
        let mut raised: Vec<PyErr> = codes.filter_map(|code| lock(&code.raised).take()).chain(tests).collect();
        if raised.is_empty() { Ok(()) } else { Err(raised.swap_remove(0).into()) }
    }

    /// Runs one frame with behaviors before it, forces and tests in it, and callables of events after it.
    pub fn extended_frame(&mut self) -> Result<()> {
        self.behave()?;
        let outcome = self.frame();
        self.take_raised().and(outcome)?;
        self.call_back()?;
        self.take_raised()
    }

    /// Adds callables of an event.
    pub fn add_calls(&mut self, event: ObjectId, callables: &[Bound<'_, PyAny>]) {
        let name = self.world.name(event).unwrap_or_default().to_string();
        let called = callables.iter().map(|object| Called { event, code: Code::new(&name, object) });
        self.extension.calls.extend(called);
    }

    /// Returns the name of the first event with a callable.
    pub fn called_event(&self) -> Option<&str> {
        self.world.name(self.extension.calls.first()?.event)
    }

    /// Returns the numbers of the callables of an event.
    pub fn calls_of(&self, event: ObjectId) -> Vec<usize> {
        let calls = self.extension.calls.iter().enumerate();
        calls.filter(|(_, called)| called.event == event).map(|(k, _)| k).collect()
    }

    /// Returns a callable by its number.
    pub fn call(&self, number: usize) -> &Code {
        &self.extension.calls[number].code
    }

    /// Gives a body or a link an intersection test, which must have `contacts`, or takes it.
    pub fn set_test(&mut self, body: ObjectId, link: Option<OfLink>, object: Option<&Bound<'_, PyAny>>) -> Result<()> {
        let object = object.map(|object| Arc::new(object.clone().unbind()));
        self.extension.set_test(&mut self.world, body, link, object)
    }

    fn behave(&mut self) -> Result<()> {
        for Attached { code, bodies } in &self.extension.behaviors {
            let view = self.world.view();
            let layout = code.layout(&view);
            let rows: Vec<i64> =
                bodies.iter().filter_map(|&id| layout.rows(id)).flatten().map(|row| row as i64).collect();
            if rows.is_empty() {
                continue;
            }
            let mut wrenches = Vec::new();
            code.call(&view, "act", Some(&rows), |part_index, wrench| wrenches.push((part_index, wrench)))?;
            let mut owners = vec![None; view.part_states.len()];
            for (id, span) in view.ids().iter().filter_map(|&id| Some((id, view.state_range(id)?))) {
                span.parts.clone().enumerate().for_each(|(part, part_index)| owners[part_index] = Some((id, part)));
            }
            for (part_index, wrench) in wrenches.into_iter().filter(|(_, wrench)| *wrench != Wrench::default()) {
                let Some((id, part)) = owners[part_index] else { continue };
                let Some(point) = self.world.part_state(id, part).map(|part_state| part_state.position()) else {
                    continue;
                };
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

    /// Adds a behavior of some bodies; it must have `act` and `fork`.
    pub fn add_behavior(&mut self, name: &str, object: &Bound<'_, PyAny>, bodies: Vec<ObjectId>) -> Result<()> {
        self.check_new(name)?;
        if bodies.is_empty() {
            return Err(Error::value(format!("behavior '{name}': expected at least one body")));
        }
        self.extension.behaviors.push(Attached { code: Code::new(name, object), bodies });
        Ok(())
    }

    fn check_new(&self, name: &str) -> Result<()> {
        match self.world.find(name).is_some() || self.extension.behaviors.iter().any(|b| b.code.name == name) {
            true => Err(tumble::dynamics::WorldError::DuplicateName(name.into()).into()),
            false => Ok(()),
        }
    }

    /// Removes a force or a behavior. Returns whether there was one of that name.
    pub fn remove_extension(&mut self, name: &str) -> Result<bool> {
        if let Some(at) = self.extension.behaviors.iter().position(|b| b.code.name == name) {
            self.extension.behaviors.remove(at);
            return Ok(true);
        }
        let Some(id) = self.world.find(name).filter(|id| self.extension.forces.contains(id)) else { return Ok(false) };
        self.world.remove(id)?;
        self.extension.forces.retain(|other| *other != id);
        Ok(true)
    }

    /// Returns the objects of all forces and behaviors.
    pub fn callables(&self) -> Vec<Callable> {
        let forces =
            self.extension.forces.iter().filter_map(|&id| self.world.get::<PythonForce>(id)).map(|force| &force.code);
        let codes = forces.chain(self.extension.behaviors.iter().map(|b| &b.code));
        let codes = codes.chain(self.extension.calls.iter().map(|called| &called.code));
        let tests = self.extension.tests.iter().map(|tested| tested.test.object.clone());
        codes.map(|code| code.object.clone()).chain(tests).collect()
    }

    /// Returns the objects that an archive writes without what Python adds to them.
    pub fn foreign(&self) -> Vec<ObjectId> {
        self.extension.forces.iter().copied().chain(self.extension.tests.iter().map(|tested| tested.body)).collect()
    }

    /// Returns the objects of the world that are forces written in Python.
    pub fn forces(&self) -> &[ObjectId] {
        &self.extension.forces
    }

    /// Registers objects made by [`empty_force`] as forces.
    pub fn expect_forces(&mut self, names: &[String]) {
        self.extension.forces = names.iter().filter_map(|name| self.world.find(name)).collect();
    }

    /// Returns all forces and behaviors with their arguments; `None` if there are none.
    pub fn pickled_extensions(&self, py: Python<'_>) -> Option<Extensions> {
        let [forces, _] = self.extensions(py);
        let name = |&id: &ObjectId| Some(self.world.name(id)?.to_string());
        let of = |b: &Attached| {
            (b.code.name.clone(), b.code.object.clone_ref(py), b.bodies.iter().filter_map(name).collect())
        };
        let behaviors = self.extension.behaviors.iter().map(of).collect();
        let calls = self.extension.calls.iter().map(|c| (c.code.name.clone(), c.code.object.clone_ref(py))).collect();
        let tests = self.extension.tests.iter();
        let tests = tests.filter_map(|t| Some((name(&t.body)?, t.test.object.clone_ref(py), t.link.clone()))).collect();
        (!self.extension.is_empty()).then_some((forces, behaviors, calls, tests))
    }

    /// Sets the objects of restored forces and adds behaviors.
    pub fn unpickle_extensions(&mut self, py: Python<'_>, extensions: Extensions) -> Result<()> {
        let (forces, behaviors, calls, tests) = extensions;
        let find = |world: &World, name: &str| {
            world.find(name).ok_or_else(|| Error::value(format!("the pickled world has no object '{name}'")))
        };
        for (name, object) in calls {
            let event = find(&self.world, &name)?;
            self.add_calls(event, &[object.into_bound(py)]);
        }
        for (name, object, link) in tests {
            let body = find(&self.world, &name)?;
            self.set_test(body, link, Some(object.bind(py)))?;
        }
        for (name, object) in forces {
            let id = self.world.find(&name).filter(|id| self.extension.forces.contains(id));
            let force = id.and_then(|id| self.world.get_mut::<PythonForce>(id));
            let force = force.ok_or_else(|| Error::value(format!("the pickled world has no force '{name}'")))?;
            force.code = Code::new(&name, object.bind(py));
        }
        for (name, object, bodies) in behaviors {
            self.check_new(&name)?;
            let bodies = bodies.iter().filter_map(|name| self.world.find(name)).collect();
            self.extension.behaviors.push(Attached { code: Code::new(&name, object.bind(py)), bodies });
        }
        Ok(())
    }

    /// Removes all forces and behaviors and returns them for the caller to drop.
    pub fn take_extension(&mut self) -> impl Send + use<> {
        let Extension { forces, behaviors, calls, tests } = std::mem::take(&mut self.extension);
        for tested in &tests {
            let _ = give(&mut self.world, tested.body, tested.link.as_ref(), None); // an error is a body that was removed
        }
        let forces: Vec<Option<Box<dyn Object>>> = forces.into_iter().map(|id| self.world.remove(id).ok()).collect();
        (forces, behaviors, calls, tests)
    }

    /// Returns names and objects of the forces, then of the behaviors, in the order of addition.
    pub fn extensions(&self, py: Python<'_>) -> [Vec<(String, Py<PyAny>)>; 2] {
        let pair = |code: &Code| (code.name.clone(), code.object.clone_ref(py));
        let forces = self
            .extension
            .forces
            .iter()
            .filter_map(|&id| self.world.get::<PythonForce>(id))
            .map(|force| pair(&force.code));
        [forces.collect(), self.extension.behaviors.iter().map(|b| pair(&b.code)).collect()]
    }
}
