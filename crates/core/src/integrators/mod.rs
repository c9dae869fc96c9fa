//! Integrators that choose their own steps.

pub(crate) mod context;
mod dormand_prince;
mod trajectory;

pub(crate) use dormand_prince::Adaptive;

#[cfg(test)]
mod tests;
