//! Adds a scripted event to a world: names to objects.

use tumble_core::{Action, ArticulatedBody, ObjectId, ScriptedEvent, Subject, World, WorldError};

use crate::parse::event::EventSpec;

impl EventSpec {
    /// Adds the event to a world that has the objects that it names.
    ///
    /// # Errors
    /// [`WorldError`]: the name is taken, or an object is absent or of another kind.
    pub fn add(&self, world: &mut World) -> Result<ObjectId, WorldError> {
        let find = |name: &String| place(world, name).map_or_else(ObjectId::default, |(id, _)| id);
        let event = ScriptedEvent::new(&self.name, self.when.map(&mut |name| find(name)));
        let event = self.actions.iter().fold(event.with_delay(self.delay_s).with_times(self.times), |event, spec| {
            let mut action = spec.map(&mut |name| find(name));
            set_part(world, spec, &mut action);
            event.with_action(action)
        });
        let id = world.add(event)?;
        world.set_enabled(id, self.enabled)?;
        Ok(id)
    }
}

/// Sets the part of a link, or its degree of freedom.
fn set_part(world: &World, spec: &Action<String>, action: &mut Action) {
    let part = |name: &str| place(world, name).map_or(0, |(_, part)| part);
    if let (Some(Subject::Part(name, _)), Some(Subject::Part(_, to))) = (spec.subject(), action.subject_mut()) {
        *to = part(name);
    }
    if let (Action::Drive { body: name, .. }, Action::Drive { body, dof, .. }) = (spec, action) {
        let link = name.rsplit_once('/').map(|(_, link)| link);
        // in the file it is that of the joint; in the world that of the whole body
        let model = world.get::<ArticulatedBody>(*body).map(|body| body.model());
        let first = model.and_then(|model| Some(model.links()[model.link(link?)?].v));
        *dof += first.unwrap_or(0);
    }
}

/// Returns the object of a name and its part 0, or the object and part of `OBJECT/LINK`.
pub fn place(world: &World, name: &str) -> Option<(ObjectId, usize)> {
    if let Some(id) = world.find(name) {
        return Some((id, 0));
    }
    let cuts = name.match_indices('/').map(|(at, _)| at);
    cuts.into_iter().find_map(|at| {
        let id = world.find(&name[..at])?;
        let model = world.get::<ArticulatedBody>(id)?.model();
        let carrier = model.frame(&name[at + 1..])?.link;
        Some((id, carrier.unwrap_or(model.links().len())))
    })
}
