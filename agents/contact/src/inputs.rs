//! The kinds of input from users that an agent takes.
//!
//! In: the kinds that a model names ([`super::Agent::inputs`]), and the kinds that a command needs. Out: the needed kinds that the agent
//! does not take, in words. Never here: commands themselves, their effect on a model.

/// A kind of input that users give an agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Input {
    /// Springs to its material points.
    Spring,
    /// Forces and impulses at its material points.
    Force,
    /// Torques, and impulses of torques.
    Torque,
    /// Poses that lead it ([`super::StepContext::pose`]): it then moves as they say, whatever touches it.
    Pose,
    /// Another place or rotation ([`super::Agent::set_motion`]).
    Place,
    /// Another velocity or spin ([`super::Agent::set_motion`]).
    Velocity,
    /// Another whole state ([`super::Agent::set_state`]).
    State,
    /// The pressure of its filling ([`super::Agent::set_pressure_pa`]).
    Pressure,
    /// Regions in which its cells are removed ([`super::Agent::carve`]).
    Carving,
    /// Another resolution ([`super::Agent::set_resolution`]).
    Resolution,
}

impl Input {
    /// All, in their order, as messages name them.
    const NAMES: [(Self, &'static str); 10] = [
        (Self::Spring, "springs"),
        (Self::Force, "forces"),
        (Self::Torque, "torques"),
        (Self::Pose, "poses"),
        (Self::Place, "other places"),
        (Self::Velocity, "other velocities"),
        (Self::State, "other states"),
        (Self::Pressure, "pressures"),
        (Self::Carving, "carving"),
        (Self::Resolution, "other resolutions"),
    ];

    /// As messages name it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize].1
    }
}

/// A set of kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct Inputs(u16);

impl Inputs {
    /// Nothing.
    pub const NONE: Self = Self(0);

    /// These.
    #[must_use]
    pub const fn of(all: &[Input]) -> Self {
        let (mut set, mut at) = (Self::NONE, 0);
        while at < all.len() {
            set = set.with(all[at], true);
            at += 1;
        }
        set
    }

    /// The same with this one if `takes`, else without it.
    #[must_use]
    pub const fn with(self, input: Input, takes: bool) -> Self {
        let bit = 1 << input as u16;
        Self(if takes { self.0 | bit } else { self.0 & !bit })
    }

    /// Whether this one is among them.
    #[must_use]
    pub const fn has(self, input: Input) -> bool {
        self.0 & (1 << input as u16) != 0
    }

    /// The first of `needed` that is not among them.
    #[must_use]
    pub fn lacks(self, needed: Self) -> Option<Input> {
        let mut all = Input::NAMES.into_iter().map(|(input, _)| input);
        all.find(|input| needed.has(*input) && !self.has(*input))
    }
}

impl std::fmt::Display for Inputs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<_> = Input::NAMES.iter().filter(|(input, _)| self.has(*input)).map(|(_, name)| *name).collect();
        match &names[..] {
            [] => f.write_str("nothing of the kind"),
            [one] => f.write_str(one),
            [first @ .., last] => write!(f, "{} and {last}", first.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_has_what_was_put_into_it_and_names_it() {
        let all = Input::NAMES.map(|(input, _)| input);
        for input in all {
            let one = Inputs::of(&[input]);
            assert!(all.into_iter().all(|other| one.has(other) == (other == input)));
            assert_eq!((one.to_string(), one.with(input, false)), (input.name().to_owned(), Inputs::NONE));
        }
        let some = Inputs::of(&[Input::Carving, Input::Force, Input::Spring]);
        assert_eq!(some.to_string(), "springs, forces and carving");
    }

    #[test]
    fn what_is_lacking_is_needed_and_not_taken() {
        let takes = Inputs::of(&[Input::Spring, Input::Force]);
        assert_eq!(takes.lacks(Inputs::of(&[Input::Force, Input::Torque])), Some(Input::Torque));
        assert_eq!((takes.lacks(takes), takes.lacks(Inputs::NONE)), (None, None));
        assert_eq!(Inputs::NONE.lacks(Inputs::of(&[Input::Pose])), Some(Input::Pose));
    }
}
