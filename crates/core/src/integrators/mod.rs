//! Integrators of smooth motion: with a fixed step (`context`) and with error control.

pub(crate) mod context;
mod dormand_prince;
mod trajectory;

pub(crate) use dormand_prince::Adaptive;

#[cfg(test)]
mod tests;
