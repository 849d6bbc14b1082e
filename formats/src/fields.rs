//! The numbers that name a direction in file name patterns and in the columns of tables.

use crate::{Angles, Doubt, Pair};

/// One number of one direction: `theta_i`, `phi_i`, `x_i`, `y_i`, `z_i` of the light, `theta_v` ... of the
/// view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Field {
    side: Side,
    component: Component,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Light,
    View,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Component {
    Theta,
    Phi,
    X,
    Y,
    Z,
}

const POLAR: [Component; 2] = [Component::Theta, Component::Phi];
const VECTOR: [Component; 3] = [Component::X, Component::Y, Component::Z];

impl Field {
    pub(crate) fn new(side: Side, component: Component) -> Self {
        Field { side, component }
    }

    /// The field of this name, without regard to case.
    pub(crate) fn named(name: &str) -> Option<Field> {
        let (component, side) = name.rsplit_once('_')?;
        let is = |found: &str, known: &str| found.eq_ignore_ascii_case(known);
        let side = [Side::Light, Side::View].into_iter().find(|known| is(side, known.name()))?;
        let mut components = POLAR.into_iter().chain(VECTOR);
        Some(Field { side, component: components.find(|known| is(component, known.name()))? })
    }

    pub(crate) fn name(self) -> String {
        format!("{}_{}", self.component.name(), self.side.name())
    }

    /// Theta and z are not: no direction points into the surface.
    pub(crate) fn may_be_negative(self) -> bool {
        !matches!(self.component, Component::Theta | Component::Z)
    }

    /// Whether it is an angle, else a component of a vector.
    pub(crate) fn is_angle(self) -> bool {
        POLAR.contains(&self.component)
    }
}

impl Side {
    fn name(self) -> &'static str {
        match self {
            Side::Light => "i",
            Side::View => "v",
        }
    }
}

impl Component {
    fn name(self) -> &'static str {
        match self {
            Component::Theta => "theta",
            Component::Phi => "phi",
            Component::X => "x",
            Component::Y => "y",
            Component::Z => "z",
        }
    }
}

/// How the direction of one side is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Polar,
    Vector,
}

/// How both directions are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Forms {
    light: Form,
    view: Option<Form>,
}

impl Forms {
    /// Sorts out the fields that there are.
    ///
    /// # Errors
    /// What is wrong, for a message that says what was found: a field twice, a direction in two forms or with a part missing,
    /// or no light.
    pub(crate) fn of(fields: &[Field]) -> Result<Forms, String> {
        let mut later = fields.iter();
        while let Some(field) = later.next() {
            if later.as_slice().contains(field) {
                return Err(format!("{} twice", field.name()));
            }
        }
        let light = form_of(Side::Light, fields)?.ok_or("no direction of the light")?;
        Ok(Forms { light, view: form_of(Side::View, fields)? })
    }

    /// Whether there is a direction of the view; without one, all images have the frontal view.
    pub(crate) fn has_view(self) -> bool {
        self.view.is_some()
    }

    /// Both directions, from the values of the fields; angles in degrees.
    ///
    /// # Errors
    /// The field at fault and what is expected of it.
    pub(crate) fn pair(self, value: impl Fn(Field) -> Option<f64>) -> Result<Pair, (Field, &'static str)> {
        let angles = |side, form| {
            let get = |component| value(Field { side, component }).unwrap_or(f64::NAN);
            match form {
                Form::Polar => Angles::new(get(Component::Theta), get(Component::Phi)).ok_or((
                    Field { side, component: Component::Theta },
                    "theta in 0..=90 degrees and phi within ten turns",
                )),
                Form::Vector => Angles::from_vector(VECTOR.map(get))
                    .map_err(|expected| (Field { side, component: Component::Z }, expected)),
            }
        };
        let view = self.view.map_or(Ok(Angles::FRONTAL), |form| angles(Side::View, form))?;
        Ok(Pair { view, light: angles(Side::Light, self.light)? })
    }
}

impl Forms {
    /// What is odd about both directions, from the values of the fields; angles in degrees.
    pub(crate) fn doubt(self, value: impl Fn(Field) -> Option<f64>) -> Option<Doubt> {
        let of = |side, form| {
            let get = |component| value(Field { side, component }).unwrap_or(f64::NAN);
            match form {
                Form::Polar => Doubt::of_angles(get(Component::Theta), get(Component::Phi)),
                Form::Vector => {
                    let vector = VECTOR.map(get);
                    let expected = Angles::from_vector(vector).err()?;
                    Some(Doubt::Impossible(format!("the vector {vector:?}, which is not {expected}")))
                }
            }
        };
        let view = self.view.and_then(|form| of(Side::View, form));
        let light = of(Side::Light, self.light);
        match light {
            Some(light) => Some(light.or_worse(view)),
            None => view,
        }
    }
}

fn form_of(side: Side, fields: &[Field]) -> Result<Option<Form>, String> {
    let has = |component: &Component| fields.contains(&Field { side, component: *component });
    let lacks = |components: &[Component]| {
        let missing = components.iter().find(|component| !has(component))?;
        Some(format!("no {} beside the other fields", Field { side, component: *missing }.name()))
    };
    let (form, missing) = match (POLAR.iter().any(has), VECTOR.iter().any(has)) {
        (false, false) => return Ok(None),
        (true, true) => return Err("angles and a vector of one direction".to_owned()),
        (true, false) => (Form::Polar, lacks(&POLAR)),
        (false, true) => (Form::Vector, lacks(&VECTOR)),
    };
    match missing {
        Some(missing) => Err(missing),
        None => Ok(Some(form)),
    }
}

/// Bytes of the decimal number that a text starts with: an optional minus sign and digits, and the same with
/// the fraction, if there is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NumberPrefix {
    pub(crate) whole: usize,
    pub(crate) all: usize,
}

impl NumberPrefix {
    pub(crate) fn of(text: &str) -> Option<NumberPrefix> {
        let digits_after = |at: usize| {
            let rest = text.as_bytes().get(at..).unwrap_or(&[]);
            rest.iter().take_while(|byte| byte.is_ascii_digit()).count()
        };
        let sign = usize::from(text.starts_with('-'));
        let whole = Some(digits_after(sign)).filter(|&digits| digits > 0)?.checked_add(sign)?;
        let point = whole.checked_add(1)?;
        let fraction = if text.as_bytes().get(whole) == Some(&b'.') { digits_after(point) } else { 0 };
        let all = if fraction > 0 { point.checked_add(fraction)? } else { whole };
        Some(NumberPrefix { whole, all })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(names: &str) -> Vec<Field> {
        names.split(' ').map(|name| Field::named(name).unwrap()).collect()
    }

    #[test]
    fn names_of_fields() {
        for name in ["theta_i", "phi_i", "x_v", "y_v", "z_v"] {
            assert_eq!(Field::named(&name.to_uppercase()).unwrap().name(), name);
        }
        for name in ["", "theta", "theta_o", "_i", "thetai", "w_i"] {
            assert_eq!(Field::named(name), None, "{name:?}");
        }
    }

    #[test]
    fn forms_are_whole_and_one_for_each_side() {
        assert!(!Forms::of(&fields("theta_i phi_i")).unwrap().has_view());
        assert!(Forms::of(&fields("x_v z_v theta_i y_v phi_i")).unwrap().has_view());
        for (names, reason) in [
            ("theta_v phi_v", "light"),
            ("theta_i", "phi_i"),
            ("x_i z_i", "y_i"),
            ("theta_i phi_i theta_v", "phi_v"),
            ("theta_i phi_i x_i", "a vector"),
            ("theta_i phi_i theta_i", "theta_i twice"),
        ] {
            let error = Forms::of(&fields(names)).unwrap_err();
            assert!(error.contains(reason), "{names}: {error}");
        }
    }

    #[test]
    fn numbers_at_the_start_of_a_text() {
        let found = |text| NumberPrefix::of(text).map(|number| (number.whole, number.all));
        assert_eq!(found("15"), Some((2, 2)));
        assert_eq!(found("-7.25.5"), Some((2, 5)));
        assert_eq!(found("3._"), Some((1, 1)));
        for text in ["", "-", ".5", "a1", "--1", "+1"] {
            assert_eq!(found(text), None, "{text:?}");
        }
    }
}
