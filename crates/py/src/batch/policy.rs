//! Policies that are evaluated within the steps of a batch: linear maps, and perceptrons of several layers.
//!
//! ```text
//! y_0 = observation        y_k = activation(W_k·y_(k−1) + b_k)        the last layer has no activation
//! ```
//!
//! Sums go through the columns in their order and `tanh` is libm's, so that a policy has the same bits in a batch, alone and on any
//! machine.

use crate::arrays::convert::{Numbers, array, numbers, shown};
use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Largest number of layers.
const MOST_LAYERS: usize = 16;

#[derive(Clone, Copy)]
enum Activation {
    Tanh,
    Relu,
}

/// Weights and offsets of a layer, as arrays.
type Pair<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

/// One layer: weights and offsets of one policy, or of several, one after the other.
struct Layer {
    inputs: usize,
    outputs: usize,
    weights: Vec<f64>,
    offsets: Vec<f64>,
}

/// A linear policy or a perceptron, evaluated within the steps of a ``Batch``.
///
/// layers: pairs (W, b) of weights, shape (outputs, inputs), and offsets, shape (outputs,), or None for
/// zeros; one pair is a linear policy. With shapes (n, outputs, inputs) and (n, outputs) world i has a policy of its own, the i-th. activation:
/// ``"tanh"`` or ``"relu"`` between layers. ``policy(observation, i=0)`` evaluates the i-th alone, with the same bits.
#[pyclass(frozen, module = "tumble")]
pub struct Policy {
    layers: Vec<Layer>,
    /// Number of policies; 0 for one that serves all worlds.
    several: usize,
    activation: Activation,
}

impl Policy {
    /// Returns the number of inputs.
    pub fn inputs(&self) -> usize {
        self.layers.first().map_or(0, |layer| layer.inputs)
    }

    /// Returns the number of outputs.
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.outputs)
    }

    /// Checks that it fits a batch.
    pub fn check(&self, worlds: usize, observation: usize, dof: usize) -> Result<()> {
        if self.several != 0 && self.several != worlds {
            return Err(Error::value(format!(
                "policy: {} policies for {worlds} worlds; give one, or one for each",
                self.several
            )));
        }
        if (self.inputs(), self.outputs()) != (observation, dof) {
            let own = (self.inputs(), self.outputs());
            return Err(Error::value(format!(
                "policy: it has {} inputs and {} outputs; the articulations have {observation} positions and velocities, and {dof} degrees of freedom",
                own.0, own.1
            )));
        }
        Ok(())
    }

    /// Evaluates the policy of a world. `work` is memory that is used again.
    pub fn act(&self, world: usize, observation: &[f64], work: &mut Vec<f64>) -> Vec<f64> {
        let own = if self.several == 0 { 0 } else { world };
        let mut y = observation.to_vec();
        for (k, layer) in self.layers.iter().enumerate() {
            layer.apply(own, &y, work);
            if k + 1 < self.layers.len() {
                work.iter_mut().for_each(|y| *y = self.activation.of(*y));
            }
            std::mem::swap(&mut y, work);
        }
        y
    }
}

impl Activation {
    const ALL: [Activation; 2] = [Activation::Tanh, Activation::Relu];

    fn name(self) -> &'static str {
        match self {
            Activation::Tanh => "tanh",
            Activation::Relu => "relu",
        }
    }

    fn of(self, x: f64) -> f64 {
        match self {
            Activation::Tanh => nalgebra::ComplexField::tanh(x),
            Activation::Relu => x.max(0.0),
        }
    }
}

impl Layer {
    /// Converts weights and offsets. Returns the layer with the number of policies, 0 for one of all worlds.
    fn new(k: usize, weights: Numbers, offsets: Option<Numbers>) -> Result<(Layer, usize)> {
        let wrong = |what: &str, expected: &str, shape: &[usize]| {
            Error::value(format!("{what} of layer {k}: expected shape {expected}, got {}", shown(shape)))
        };
        let (several, outputs, inputs) = match weights.shape[..] {
            [outputs, inputs] if outputs > 0 && inputs > 0 => (0, outputs, inputs),
            [n, outputs, inputs] if n > 0 && outputs > 0 && inputs > 0 => (n, outputs, inputs),
            _ => return Err(wrong("weights", "(outputs, inputs) or (n, outputs, inputs)", &weights.shape)),
        };
        let shape = if several == 0 { vec![outputs] } else { vec![several, outputs] };
        let offsets = match offsets {
            None => vec![0.0; several.max(1) * outputs],
            Some(given) if given.shape == shape => given.data,
            Some(given) => return Err(wrong("offsets", &shown(&shape), &given.shape)),
        };
        Ok((Layer { inputs, outputs, weights: weights.data, offsets }, several))
    }

    /// Returns weights and offsets in the shapes in which they were given. `several`: the number of policies, 0 for one of all worlds.
    fn arrays<'py>(&self, py: Python<'py>, several: usize) -> Result<Pair<'py>> {
        let shaped = |values: &[f64], shape: &[usize]| {
            let shape = if several == 0 { shape.to_vec() } else { [&[several], shape].concat() };
            array(py, values).call_method1("reshape", (shape,))
        };
        let weights = shaped(&self.weights, &[self.outputs, self.inputs])?;
        Ok((weights, shaped(&self.offsets, &[self.outputs])?))
    }

    fn apply(&self, policy: usize, x: &[f64], y: &mut Vec<f64>) {
        let weights = &self.weights[policy * self.outputs * self.inputs..];
        let offsets = &self.offsets[policy * self.outputs..][..self.outputs];
        y.clear();
        for (row, offset) in weights.chunks_exact(self.inputs).zip(offsets) {
            y.push(row.iter().zip(x).fold(*offset, |sum, (w, x)| sum + w * x));
        }
    }
}

#[pymethods]
impl Policy {
    #[new]
    #[pyo3(signature = (layers, *, activation="tanh", **unknown), text_signature = "(layers, *, activation='tanh')")]
    fn new(
        layers: Vec<(Bound<'_, PyAny>, Option<Bound<'_, PyAny>>)>,
        activation: &str,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Policy> {
        keywords::check(unknown, "Policy")?;
        let unknown = || Error::Name(format!("unknown activation '{activation}'; there are 'tanh' and 'relu'"));
        let activation = Activation::ALL.into_iter().find(|a| a.name() == activation).ok_or_else(unknown)?;
        if layers.is_empty() || layers.len() > MOST_LAYERS {
            return Err(Error::value(format!("layers: {} given; a policy has 1 to {MOST_LAYERS}", layers.len())));
        }
        let mut policy = Policy { layers: Vec::new(), several: 0, activation };
        for (k, (weights, offsets)) in layers.iter().enumerate() {
            let offsets = offsets.as_ref().map(|given| numbers(given, "offsets")).transpose()?;
            let (layer, several) = Layer::new(k, numbers(weights, "weights")?, offsets)?;
            if k > 0 && (several, layer.inputs) != (policy.several, policy.outputs()) {
                return Err(Error::value(format!(
                    "layer {k} has {} inputs of {several} policies; the layer before has {} outputs of {} (0: one for all)",
                    layer.inputs,
                    policy.outputs(),
                    policy.several
                )));
            }
            policy.several = several;
            policy.layers.push(layer);
        }
        Ok(policy)
    }

    /// Pickles the arguments of the constructor.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Result<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (py, own) = (slf.py(), slf.get());
        let layers = own.layers.iter().map(|layer| layer.arrays(py, own.several)).collect::<Result<Vec<_>>>()?;
        let words = PyDict::new(py);
        words.set_item("activation", own.activation.name())?;
        let arguments = (slf.get_type(), (layers,), words).into_pyobject(py)?;
        Ok((py.import("copyreg")?.getattr("__newobj_ex__")?, arguments.into_any()))
    }

    /// Returns the outputs for an observation, shape (inputs,), by the i-th policy.
    #[pyo3(signature = (observation, i=0))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        observation: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole::i)] i: usize,
    ) -> Result<Bound<'py, PyArray1<f64>>> {
        let given = numbers(observation, "observation")?;
        if given.shape != [self.inputs()] {
            return Err(Error::value(format!(
                "observation: expected shape ({},), got {}",
                self.inputs(),
                shown(&given.shape)
            )));
        }
        if i >= self.several.max(1) {
            return Err(Error::value(format!("i is {i}; there are {} policies", self.several.max(1))));
        }
        Ok(array(py, &self.act(i, &given.data, &mut Vec::new())))
    }
}
