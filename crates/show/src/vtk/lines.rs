//! Histories of light as lines in a VTK file.

use std::{
    collections::BTreeMap,
    io::{self, Write},
};

use super::{VtkKind, array, element, file, names};
use phylux_results::histories::{HistoriesLine, HistoriesResult};

/// The names of the lines' lights, surfaces, materials or captors, each with its index.
#[derive(Default)]
struct Names<'r>(BTreeMap<&'r str, i32>);

impl<'r> Names<'r> {
    fn new(all: impl Iterator<Item = &'r str>) -> Self {
        let mut names: BTreeMap<&str, i32> = all.map(|name| (name, 0)).collect();
        names.values_mut().zip(0..).for_each(|(index, next)| *index = next);
        Self(names)
    }

    fn index(&self, name: Option<&str>) -> i32 {
        name.and_then(|name| self.0.get(name)).copied().unwrap_or(-1)
    }
}

/// Writes the lines of histories as polylines (`.vtp`), m from the user's origin. Each line has the
/// index of its light, last surface, its material, and captor, the face (0 front, 1 back), the number
/// of surfaces on its way, and the share of its group; each point has the index of its surface and
/// material. -1 stands where there is none; the names are field data. Errors: writing fails.
pub fn write_vtk_lines(result: &HistoriesResult, writer: &mut dyn Write) -> io::Result<()> {
    let lines = &result.lines;
    let all = |of: fn(&HistoriesLine) -> &str| Names::new(lines.iter().map(of));
    let lights = all(|line| &line.light);
    let captors = all(|line| &line.captor);
    let met = || lines.iter().flat_map(|line| &line.met);
    let lasts = lines.iter().map(|line| line.last_surface.as_str());
    let surfaces = Names::new(met().map(|met| met[0].as_str()).chain(lasts));
    let materials = Names::new(met().map(|met| met[1].as_str()));
    let count = lines.iter().map(|line| line.points.len()).sum::<usize>();
    file("PolyData", writer, |xml| {
        element(xml, "FieldData", &[], |xml| {
            let kind = VtkKind::PolyData;
            names(xml, kind, "scene", [result.scene.as_str()].into_iter())?;
            names(xml, kind, "to", [result.to.as_str()].into_iter())?;
            names(xml, kind, "band", [result.band.as_str()].into_iter())?;
            let named = [
                ("lights", &lights),
                ("surfaces", &surfaces),
                ("materials", &materials),
                ("captors", &captors),
            ];
            named
                .into_iter()
                .try_for_each(|(name, all)| names(xml, kind, name, all.0.keys().copied()))
        })?;
        let sizes = [count, lines.len()].map(|size| size.to_string());
        let sizes = [("NumberOfPoints", &*sizes[0]), ("NumberOfLines", &*sizes[1])];
        element(xml, "Piece", &sizes, |xml| {
            element(xml, "PointData", &[], |xml| {
                for (name, names, which) in [("surface", &surfaces, 0), ("material", &materials, 1)]
                {
                    let of_line = |line: &HistoriesLine| -> Vec<i32> {
                        let met = line.met.iter().map(|met| names.index(Some(&met[which])));
                        [-1].into_iter().chain(met).chain([-1]).collect()
                    };
                    let values: Vec<i32> = lines.iter().flat_map(of_line).collect();
                    array(xml, "Int32", name, &[], values.iter().map(|v| v.to_le_bytes()))?;
                }
                Ok(())
            })?;
            element(xml, "CellData", &[], |xml| {
                let mut column = |name: &str, value: &dyn Fn(&HistoriesLine) -> i32| {
                    let values = lines.iter().map(|line| value(line).to_le_bytes());
                    array(xml, "Int32", name, &[], values)
                };
                column("light", &|line| lights.index(Some(&line.light)))?;
                column("last_surface", &|line| surfaces.index(Some(&line.last_surface)))?;
                column("last_material", &|line| materials.index(line.material.as_deref()))?;
                column("captor", &|line| captors.index(Some(&line.captor)))?;
                column("face", &|line| i32::from(line.face == "back"))?;
                column("met", &|line| line.met.len() as i32)?;
                let share = lines.iter().map(|line| result.share_of(line).unwrap_or(f64::NAN));
                array(xml, "Float32", "share", &[], share.map(|v| (v as f32).to_le_bytes()))
            })?;
            element(xml, "Points", &[], |xml| {
                let points = lines.iter().flat_map(|line| line.points.as_flattened());
                let points: Vec<f64> = points.copied().collect();
                let coordinates = points.iter().map(|p| p.to_le_bytes());
                array(xml, "Float64", "points", &[("NumberOfComponents", "3")], coordinates)
            })?;
            element(xml, "Lines", &[], |xml| {
                let corners = 0..count as i64;
                let corners: Vec<i64> = corners.collect();
                array(xml, "Int64", "connectivity", &[], corners.iter().map(|c| c.to_le_bytes()))?;
                let ends = lines.iter().scan(0i64, |end, line| {
                    *end += line.points.len() as i64;
                    Some(*end)
                });
                let ends: Vec<i64> = ends.collect();
                array(xml, "Int64", "offsets", &[], ends.iter().map(|end| end.to_le_bytes()))
            })
        })
    })
}
