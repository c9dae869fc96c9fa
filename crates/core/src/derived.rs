//! Values derived from a state: part states and the caches of objects.

use crate::object::part_state::PartState;
use std::any::Any;

/// Values that an object derives from one state besides its part states (mass matrix, factors), and
/// the working memory of its calls.
///
/// [`Object::new_cache`](crate::Object::new_cache) makes it,
/// [`Object::refresh`](crate::Object::refresh) writes it, the maps of
/// [`Integratable`](crate::Integratable) read it. An object may have several at once, each for
/// another state.
pub struct Cache(Box<dyn Any + Send + Sync>);

impl Cache {
    /// Makes a cache of a value.
    pub fn new<T: Any + Send + Sync>(value: T) -> Cache {
        Cache(Box::new(value))
    }

    /// Returns the value of a cache that was made of one of this type.
    ///
    /// # Panics
    /// If it was made of another type. An object is only given caches that it made.
    pub fn get<T: Any>(&mut self) -> &mut T {
        match self.0.downcast_mut() {
            Some(value) => value,
            None => unreachable!("an object is given the caches that it made"),
        }
    }
}

impl Cache {
    /// Returns the value of a cache for reading; like [`get`](Self::get).
    ///
    /// # Panics
    /// If it was made of another type.
    pub fn read<T: Any>(&self) -> &T {
        match self.0.downcast_ref() {
            Some(value) => value,
            None => unreachable!("an object is given the caches that it made"),
        }
    }
}

impl Default for Cache {
    /// A cache of nothing.
    fn default() -> Cache {
        Cache::new(())
    }
}

/// Values derived from one state of all objects.
#[derive(Default)]
pub(crate) struct Derived {
    /// One per part, in the order of the part table.
    pub part_states: Vec<PartState>,
    /// One per object, in the order of adding.
    pub caches: Vec<Cache>,
}
