//! What the id of a captor says of its place on a plant.

/// The parts of a captor's id: object, part and instance, as in `OBJECT/PART#INSTANCE`.
#[derive(Debug, PartialEq)]
pub(super) struct Organ<'a> {
    pub object: &'a str,
    /// The number of the instance, from 0; `None` for an object without instances.
    pub instance: Option<&'a str>,
    /// The number at the end of the part's name, such as 3 of `leaf3`.
    pub rank: Option<u32>,
}

impl<'a> Organ<'a> {
    pub fn of(id: &'a str) -> Self {
        let is_number = |n: &str| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit());
        let numbered = |text: &'a str| {
            let (name, number) = text.rsplit_once('#')?;
            is_number(number).then_some((name, number))
        };
        let Some((object, part)) = id.split_once('/') else {
            // a whole instance
            let (object, instance) = numbered(id).map_or((id, None), |(name, n)| (name, Some(n)));
            return Self { object, instance, rank: None };
        };
        // ids of single triangles end with `/` and the number of the triangle
        let part = match part.rsplit_once('/') {
            Some((part, number)) if is_number(number) => part,
            _ => part,
        };
        let (part, instance) = numbered(part).map_or((part, None), |(name, n)| (name, Some(n)));
        let digits = part.len() - part.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        Self { object, instance, rank: part[part.len() - digits..].parse().ok() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_name_plant_and_rank() {
        let organ = |object, instance, rank| Organ { object, instance, rank };
        for (id, known) in [
            ("tomato-1/leaf3#10", organ("tomato-1", Some("10"), Some(3))),
            ("tomato-1/stem#0", organ("tomato-1", Some("0"), None)),
            ("plant/leaf12", organ("plant", None, Some(12))),
            ("plant/leaf12#4/77", organ("plant", Some("4"), Some(12))),
            ("room", organ("room", None, None)),
            ("a/b#c", organ("a", None, None)),
            ("a/99999999999", organ("a", None, None)),
            ("é/é1#", organ("é", None, None)),
            ("lettuce#7", organ("lettuce", Some("7"), None)),
            ("lettuce#", organ("lettuce#", None, None)),
            ("soil/field/77", organ("soil", None, None)),
            ("plant/leaf2/77", organ("plant", None, Some(2))),
        ] {
            assert_eq!(Organ::of(id), known, "{id}");
        }
    }
}
