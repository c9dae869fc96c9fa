//! Python classes of bodies, shapes and sphere trees.

pub mod appearance;
pub mod articulation;
pub mod articulation_status;
pub mod binding;
pub mod bodies;
pub mod body;
pub mod builder;
pub mod derivatives;
pub mod description;
pub mod handle;
pub mod joint;
pub mod joint_constants;
pub mod joint_dof;
pub mod joints;
pub mod link;
pub mod mimic;
pub mod mounts;
pub mod place;
pub mod robot;
pub mod sensor;
pub mod shape_material;
pub mod shape_names;
pub mod shapes;
pub mod sphere_robot;
pub mod spheretree;
pub mod terrain;
