//! `Clone` for structs of tables that are copied every frame.

/// Implements `Clone` for a struct, given all of its fields. `clone_from` clones every field into
/// the memory that the old one has, which the derived `clone_from` does not.
macro_rules! clone_by_field {
    ($type:ident { $($field:ident),* $(,)? }) => {
        impl Clone for $type {
            fn clone(&self) -> $type {
                $type { $($field: Clone::clone(&self.$field)),* }
            }

            fn clone_from(&mut self, from: &$type) {
                let $type { $($field),* } = from;
                $(Clone::clone_from(&mut self.$field, $field);)*
            }
        }
    };
}

pub(crate) use clone_by_field;
