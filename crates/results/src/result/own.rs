//! Quantities of a captor, group or layer that the registry alone knows.

use std::{borrow::Cow, fmt};

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{IgnoredAny, MapAccess, Visitor},
    ser::SerializeMap,
};

use crate::quantity::{Column, Per, Quantity};
use phylux_core::transport::{
    simulate::Simulation,
    sunlit::{sunlit_layers, sunlit_shares},
};

/// The ending of keys of standard errors.
const ERROR: &str = "_se";

/// Quantities of a captor, group or layer by their names in the registry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Own(Vec<Kept>);

#[derive(Clone, Debug, PartialEq)]
struct Kept {
    name: &'static str,
    values: Vec<Option<f64>>,
    errors: Vec<Option<f64>>,
}

impl Own {
    /// Adds a quantity of the place as a whole, with its standard error.
    pub fn with(mut self, name: &str, found: Option<[f64; 2]>) -> Self {
        if let Some(found) = found {
            let [values, errors] = found.map(|number| vec![Some(number)]);
            self.0.push(Kept { name: Quantity::named(name).name, values, errors });
        }
        self
    }

    /// Returns the values of a quantity.
    pub fn get(&self, name: &str) -> Option<Column<'_>> {
        let kept = self.0.iter().find(|kept| kept.name == name)?;
        let errors = Some(&kept.errors[..]).filter(|errors| !errors.is_empty());
        Some(Column::perhaps(&kept.values, errors))
    }

    /// Returns a quantity of the place as a whole, with its standard error.
    pub fn one(&self, name: &str) -> Option<(f64, Option<f64>)> {
        let column = self.get(name)?;
        Some((column.value(0)?, column.errors(0)[0]))
    }

    /// Returns the place of a quantity that is read.
    fn kept(&mut self, name: &'static str) -> &mut Kept {
        let at = self.0.iter().position(|kept| kept.name == name).unwrap_or_else(|| {
            self.0.push(Kept { name, values: Vec::new(), errors: Vec::new() });
            self.0.len() - 1
        });
        &mut self.0[at]
    }
}

/// Returns what a captor, by its index, has where the scene asks for it.
pub(super) fn of_captors(simulation: &Simulation) -> impl Fn(usize) -> Own {
    let (scene, seed) = (simulation.scene(), simulation.settings().seed);
    let sunlit = scene.asked().sunlit.then(|| sunlit_shares(scene, seed)).flatten();
    move |captor| Own::default().with("sunlit", sunlit.as_ref().map(|shares| shares[captor]))
}

/// Returns what a layer, by its index, has where the scene asks for it.
pub(super) fn of_layers(simulation: &Simulation) -> impl Fn(usize) -> Own {
    let (scene, seed) = (simulation.scene(), simulation.settings().seed);
    let sunlit = scene.asked().sunlit.then(|| sunlit_layers(scene, seed)).flatten();
    move |layer| Own::default().with("sunlit", sunlit.as_ref().and_then(|shares| shares[layer]))
}

impl Serialize for Own {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for Kept { name, values, errors } in &self.0 {
            for (key, numbers) in [(Cow::Borrowed(*name), values), (error_of(name).into(), errors)]
            {
                match Quantity::named(name).per {
                    _ if numbers.is_empty() => {}
                    Per::Place => map.serialize_entry(&*key, &numbers[0])?,
                    _ => map.serialize_entry(&*key, numbers)?,
                }
            }
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Own {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Names;
        impl<'de> Visitor<'de> for Names {
            type Value = Own;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("quantities by their names")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Own, A::Error> {
                let mut own = Own::default();
                while let Some(key) = map.next_key::<Cow<'de, str>>()? {
                    let name = key.strip_suffix(ERROR).unwrap_or(&key);
                    let Some(of) = Quantity::own().find(|quantity| quantity.name == name) else {
                        map.next_value::<IgnoredAny>()?;
                        continue;
                    };
                    let numbers: Vec<Option<f64>> = match of.per {
                        Per::Place => {
                            map.next_value::<Option<f64>>()?.map(Some).into_iter().collect()
                        }
                        _ => map.next_value()?,
                    };
                    let kept = own.kept(of.name);
                    *(if *name == *key { &mut kept.values } else { &mut kept.errors }) = numbers;
                }
                Ok(own)
            }
        }
        deserializer.deserialize_map(Names)
    }
}

impl JsonSchema for Own {
    fn schema_name() -> Cow<'static, str> {
        "Own".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = json_schema!({ "type": ["number", "null"], "format": "double" });
        let mut properties = IndexMap::new();
        for quantity in Quantity::own() {
            let error = "Standard error of the value above.";
            for (key, meaning) in
                [(quantity.name.to_string(), quantity.meaning), (error_of(quantity.name), error)]
            {
                let mut schema = json_schema!({ "description": meaning });
                let of = match quantity.per {
                    Per::Place => number.clone(),
                    _ => json_schema!({ "type": ["array", "null"], "items": number }),
                };
                of.as_object().into_iter().flatten().for_each(|(key, value)| {
                    schema.insert(key.clone(), value.clone());
                });
                properties.insert(key, schema);
            }
        }
        json_schema!({ "type": "object", "properties": properties })
    }
}

fn error_of(name: &str) -> String {
    format!("{name}{ERROR}")
}

/// Means over area of what captors have, whose errors are independent.
#[derive(Clone, Default)]
pub(super) struct Means(Vec<(&'static str, [f64; 2])>);

impl Means {
    /// Adds the quantities of a captor with this area, m2.
    pub fn add(&mut self, own: &Own, area: f64) {
        for quantity in Quantity::own().filter(|quantity| quantity.is_mean) {
            let Some((value, Some(error))) = own.one(quantity.name) else { continue };
            let at = self.0.iter().position(|(name, _)| *name == quantity.name);
            let at = at.unwrap_or_else(|| {
                self.0.push((quantity.name, [0.0; 2]));
                self.0.len() - 1
            });
            let [sum, variance] = &mut self.0[at].1;
            *sum += value * area;
            *variance += (error * area).powi(2);
        }
    }

    /// Returns the means over this area, m2.
    pub fn over(&self, area: f64) -> Own {
        let mean = |[sum, variance]: [f64; 2]| Some([sum / area, variance.sqrt() / area]);
        self.0.iter().fold(Own::default(), |own, (name, sums)| own.with(name, mean(*sums)))
    }
}
