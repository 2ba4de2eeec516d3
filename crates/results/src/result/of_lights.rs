//! Values of the lights at one place, which take little room beside the values.

use std::{cell::RefCell, fmt, marker::PhantomData, ops::Index, sync::Arc};

use indexmap::IndexSet;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{MapAccess, Visitor},
};

use super::ByLight;

type Names = IndexSet<String>;

thread_local! {
    /// The names of the lights at the place before, which are most often those of the next one.
    static BEFORE: RefCell<Arc<Names>> = RefCell::default();
}

/// A value for each light of a captor's or group's face by the light's name, in the order of the scene.
/// Places whose lights have the same names share them.
#[derive(Clone, Debug)]
pub struct OfLights<T> {
    names: Arc<Names>,
    values: Vec<T>,
}

impl<T> OfLights<T> {
    /// Returns the number of lights.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns whether there are no lights.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Returns the value of a light by its name.
    pub fn get(&self, light: &str) -> Option<&T> {
        self.values.get(self.names.get_index_of(light)?)
    }

    /// Returns the value of a light by its index.
    pub fn get_index(&self, light: usize) -> Option<&T> {
        self.values.get(light)
    }

    /// Returns the names of the lights.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Returns the values of the lights.
    pub fn values(&self) -> std::slice::Iter<'_, T> {
        self.values.iter()
    }

    /// Returns the values of the lights, to change them.
    pub fn values_mut(&mut self) -> std::slice::IterMut<'_, T> {
        self.values.iter_mut()
    }

    /// Returns the names and values of the lights.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> + Clone {
        self.names.iter().map(String::as_str).zip(&self.values)
    }

    /// Returns as many values, made from the name and value of each light.
    pub fn map<U>(&self, of: impl Fn(&str, &T) -> U) -> OfLights<U> {
        let values = self.iter().map(|(light, value)| of(light, value)).collect();
        OfLights { names: self.names.clone(), values }
    }
}

impl<T> Index<&str> for OfLights<T> {
    type Output = T;

    fn index(&self, light: &str) -> &T {
        self.get(light).unwrap_or_else(|| panic!("no light has the name {light:?}"))
    }
}

impl<N: Into<String> + AsRef<str>, T> FromIterator<(N, T)> for OfLights<T> {
    fn from_iter<I: IntoIterator<Item = (N, T)>>(lights: I) -> Self {
        let mut growing = Growing::new();
        lights.into_iter().for_each(|(light, value)| growing.add(light, value));
        growing.done()
    }
}

/// Values of lights that come one after the other.
struct Growing<T> {
    before: Arc<Names>,
    /// The names, once one of them is not that of the place before.
    own: Option<Names>,
    values: Vec<T>,
}

impl<T> Growing<T> {
    fn new() -> Self {
        let before = BEFORE.with_borrow(Arc::clone);
        Self { values: Vec::with_capacity(before.len()), before, own: None }
    }

    /// Adds the value of a light. Of two with one name the latter counts.
    fn add<N: Into<String> + AsRef<str>>(&mut self, light: N, value: T) {
        let next = self.values.len();
        let same = self.before.get_index(next).is_some_and(|name| name == light.as_ref());
        if self.own.is_none() && same {
            return self.values.push(value);
        }
        let own = self.own.get_or_insert_with(|| self.before.iter().take(next).cloned().collect());
        match own.insert_full(light.into()) {
            (_, true) => self.values.push(value),
            (at, false) => self.values[at] = value,
        }
    }

    fn done(mut self) -> OfLights<T> {
        self.values.shrink_to_fit();
        let Self { before, own, values } = self;
        if own.is_none() && values.len() == before.len() {
            return OfLights { names: before, values };
        }
        let own = own.unwrap_or_else(|| before.iter().take(values.len()).cloned().collect());
        let names = Arc::new(own);
        BEFORE.set(names.clone());
        OfLights { names, values }
    }
}

impl<T: Serialize> Serialize for OfLights<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OfLights<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reading<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Reading<T> {
            type Value = OfLights<T>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a value for each light")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut lights: M) -> Result<OfLights<T>, M::Error> {
                let mut growing = Growing::new();
                while let Some((light, value)) = lights.next_entry::<String, T>()? {
                    growing.add(light, value);
                }
                Ok(growing.done())
            }
        }

        deserializer.deserialize_map(Reading(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for OfLights<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        ByLight::<T>::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        ByLight::<T>::json_schema(generator)
    }

    fn inline_schema() -> bool {
        ByLight::<T>::inline_schema()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lights come back with their names and in their order, whatever the place before had; where
    /// they are the same the names are kept once.
    #[test]
    fn lights_keep_their_names_whatever_came_before() {
        let lists: [&[(&str, f64)]; 7] = [
            &[("a", 1.0), ("b", 2.0), ("c", 3.0)],
            &[("a", 4.0), ("b", 5.0), ("c", 6.0)],
            &[("a", 1.0), ("b", 2.0)],
            &[("a", 1.0), ("d", 2.0), ("b", 3.0)],
            &[],
            &[("b", 1.0), ("a", 2.0), ("b", 3.0)],
            &[("b", 1.0), ("a", 2.0), ("c", 4.0)],
        ];
        let of = |lights: &[(&str, f64)]| lights.iter().copied().collect::<OfLights<f64>>();
        for lights in lists {
            let expected: ByLight<f64> =
                lights.iter().map(|&(light, value)| (light.to_string(), value)).collect();
            let found = of(lights);
            let written = serde_json::to_string(&found).expect("text");
            assert_eq!(written, serde_json::to_string(&expected).expect("text"));
            let read: OfLights<f64> = serde_json::from_str(&written).expect("a map");
            assert!(read.iter().eq(found.iter()));
            assert!(expected.iter().all(|(light, value)| found.get(light) == Some(value)));
            assert_eq!(found.get("nobody"), None);
        }
        let [one, other] = [of(lists[0]), of(lists[1])];
        assert!(Arc::ptr_eq(&one.names, &other.names));
        assert!(Arc::ptr_eq(&one.names, &one.map(|_, value| value * 2.0).names));
    }
}
