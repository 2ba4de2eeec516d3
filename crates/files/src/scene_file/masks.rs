//! Cuts the triangles of objects along the masks that their MTL entries name (`map_d`).

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::DVec2;

use super::{loader::Loader, spec::ObjectSpec};
use crate::{
    input::quoted,
    mask::{Bitmap, Channel, Mask, Picture},
    obj::{MissingMtl, MtlEntry, ObjFile, TextureMap, textures},
};
use phylux_core::{error::Result, math::geometry::area, scene::world::MAX_TRIANGLES};

/// Where the triangles of a cut object come from; both lists are empty if nothing is cut.
#[derive(Default)]
pub(super) struct Pieces {
    /// For each triangle, its index among those of the file as it is.
    pub(super) sources: Vec<usize>,
    /// For each triangle, its number in its group of the file as it is.
    pub(super) numbers: Vec<usize>,
}

impl Loader<'_> {
    /// Returns the triangles of an object as its masks leave them, whichever materials the faces
    /// then get.
    pub(super) fn masked(
        &mut self,
        pointer: &str,
        file: &ObjectSpec,
        obj: Arc<ObjFile>,
    ) -> Result<(Arc<ObjFile>, Pieces)> {
        if file.mask == Some(false) {
            return Ok((obj, Pieces::default()));
        }
        let Some(name) = file.obj.as_deref().filter(|name| !name.starts_with("mesh:")) else {
            return match file.mask {
                None => Ok((obj, Pieces::default())),
                Some(_) => Err(self
                    .error(format!("{pointer}/mask"), "goes with an OBJ file only")
                    .remedy("leave it out")),
            };
        };
        let mut entries: BTreeMap<String, (MtlEntry, TextureMap, Bitmap)> = BTreeMap::new();
        let mut seen: Vec<&str> = Vec::new();
        for material in obj.parts.iter().filter_map(|part| part.material.as_deref()) {
            if seen.contains(&material) {
                continue;
            }
            seen.push(material);
            if let Some((entry, map, bitmap)) = self.mask_of(&obj, material) {
                entries.insert(material.into(), (entry, map, bitmap));
            }
        }
        // an entry in a file that is missing may have a mask, if faces have texture coordinates
        let unknown = seen.iter().any(|name| obj.mtl.written(name).is_none());
        let missing = if unknown { obj.mtl.missing() } else { &[] };
        if entries.is_empty() && missing.is_empty() {
            return Ok((obj, Pieces::default()));
        }
        let path = self.files.sibling(name);
        let textures = textures(&self.files.bytes(&format!("{pointer}/obj"), &path)?);
        let may_be_cut = textures.iter().any(Option::is_some);
        for MissingMtl { file, place, why } in missing.iter().filter(|_| may_be_cut) {
            let problem = format!(
                "{file}: {why}; if it names masks (`map_d`), they cut no faces, and their area may be \
                too large: fetch it, or say \"mask\": false on the object"
            );
            self.told.warn_once(place.clone(), problem);
        }
        if entries.is_empty() {
            return Ok((obj, Pieces::default()));
        }
        if textures.len() != obj.triangles() {
            return Ok((obj, Pieces::default()));
        }
        self.cut(pointer, &path, &obj, &textures, entries)
    }

    /// Cuts the parts of a file whose materials have masks.
    fn cut(
        &mut self,
        pointer: &str,
        path: &Path,
        obj: &Arc<ObjFile>,
        textures: &[Option<[DVec2; 3]>],
        entries: BTreeMap<String, (MtlEntry, TextureMap, Bitmap)>,
    ) -> Result<(Arc<ObjFile>, Pieces)> {
        let mut masks = BTreeMap::new();
        for (material, (entry, map, bitmap)) in entries {
            let corners = textures.iter().flatten().flatten().map(|at| map.place(*at).abs());
            let reach = corners.map(DVec2::max_element).fold(1.0, f64::max);
            match Mask::new(bitmap, map.clamp, reach.ceil()) {
                Ok(mask) => _ = masks.insert(material, (entry, map, mask, Cut::default())),
                Err(why) => self.no_mask(&entry, &map.file, &why),
            }
        }
        let mut found = ObjFile { parts: Vec::new(), ..(**obj).clone() };
        let mut pieces = Pieces::default();
        let mut of_group = vec![0; obj.groups.len()];
        let mut first = 0;
        for part in &obj.parts {
            let range = first..first + part.triangles.len();
            let number = of_group[part.group];
            of_group[part.group] += part.triangles.len();
            let start = first;
            first = range.end;
            let mut part = part.clone();
            let mask = part.material.as_ref().and_then(|name| masks.get_mut(name));
            let Some((entry, map, mask, sum)) = mask else {
                pieces.sources.extend(range);
                pieces.numbers.extend(number..number + part.triangles.len());
                found.parts.push(part);
                continue;
            };
            let placed: Vec<_> =
                textures[range].iter().map(|t| t.map(|t| t.map(|at| map.place(at)))).collect();
            let most = MAX_TRIANGLES - pieces.sources.len().min(MAX_TRIANGLES);
            let left = mask.cut(&part.triangles, &placed, most).map_err(|why| {
                let problem = format!("{}: the mask {} {why}", entry.place, quoted(&map.file));
                self.error(pointer, problem).remedy("or say \"mask\": false")
            })?;
            sum.bare += placed.iter().filter(|texture| texture.is_none()).count();
            sum.before += part.triangles.iter().map(area).sum::<f64>();
            part.triangles = left.iter().map(|piece| piece.corners).collect();
            sum.after += part.triangles.iter().map(area).sum::<f64>();
            pieces.sources.extend(left.iter().map(|piece| start + piece.source));
            pieces.numbers.extend(left.iter().map(|piece| number + piece.source));
            if part.triangles.is_empty() {
                let group = obj.groups[part.group].name.as_deref().unwrap_or("without a group");
                sum.gone.push(format!("{}:{} ({})", path.display(), part.line, quoted(group)));
            } else {
                found.parts.push(part);
            }
        }
        if found.parts.is_empty() {
            return Err(self
                .error(pointer, "its masks (`map_d`) leave nothing of it")
                .remedy("look at the masks and the texture coordinates, or say \"mask\": false"));
        }
        for (entry, map, _, sum) in masks.into_values() {
            self.tell_cut(&entry, &map.file, &sum);
        }
        match found == **obj {
            true => Ok((obj.clone(), Pieces::default())),
            false => Ok((Arc::new(found), pieces)),
        }
    }

    /// Says once what a mask has done.
    fn tell_cut(&mut self, entry: &MtlEntry, file: &str, sum: &Cut) {
        let place = of_entry(entry);
        let file = quoted(file);
        if sum.after < sum.before {
            let percent = 100.0 * (1.0 - sum.after / sum.before);
            let problem = format!(
                "its mask {file} cuts {percent:.1} % of the area of its faces (\"mask\": false on \
                the object leaves them whole)"
            );
            self.told.note(&place, problem);
        }
        if let Some(first) = sum.gone.first() {
            let problem = format!(
                "its mask {file} leaves nothing of {} runs of faces, the first at {first}",
                sum.gone.len()
            );
            self.told.warn(&place, problem);
        }
        if sum.bare > 0 {
            let problem = format!(
                "{} triangles without texture coordinates (`vt`) are not cut by its mask {file}",
                sum.bare
            );
            self.told.warn(&place, problem);
        }
    }

    fn no_mask(&mut self, entry: &MtlEntry, file: &str, why: &str) {
        let problem = format!(
            "its mask {} {why}: its faces are not cut, and their area may be too large; mend it, or \
            say \"mask\": false on the object",
            quoted(file)
        );
        self.told.warn(of_entry(entry), problem);
    }

    /// Says which masks do not cut a mesh, because it is a captor or a light and no object.
    pub(super) fn say_not_cut(&mut self, pointer: &str, obj: &ObjFile) {
        let names: BTreeSet<&str> =
            obj.parts.iter().filter_map(|part| part.material.as_deref()).collect();
        for name in names {
            if obj.mtl.written(name).is_none_or(|entry| entry.map_d.is_none()) {
                continue;
            }
            let Some((entry, map, bitmap)) = self.mask_of(obj, name) else { continue };
            if bitmap.share() < 1.0 {
                let problem = format!(
                    "the mask {} of {} does not cut it, since masks cut objects alone: its faces are \
                    whole, and its area may be too large; give a mesh with the outline itself",
                    quoted(&map.file),
                    of_entry(&entry)
                );
                self.told.warn(self.place(pointer), problem);
            }
        }
    }

    /// Reads the mask that the MTL entry of a material names, if it names one.
    fn mask_of(&mut self, obj: &ObjFile, material: &str) -> Option<(MtlEntry, TextureMap, Bitmap)> {
        // an error in the entry is reported where its colours are needed
        let entry = obj.mtl.written(material)?.clone();
        let colour = entry.map_kd.as_deref().map(TextureMap::parse).and_then(|map| map.ok());
        let Some(text) = &entry.map_d else {
            let colour = colour?;
            // without a word about opacity a colour is a colour, but its alpha may be meant
            let picture = Picture::read(&self.texture(&entry, &colour.file).ok()?).ok()?;
            let share = 1.0 - picture.bitmap(Channel::Alpha, [0.0, 1.0]).share();
            if share > 0.0 {
                let file = quoted(&colour.file);
                let problem = format!(
                    "{:.1} % of its texture {file} are transparent, but nothing says that this cuts \
                    its faces, so they stay whole; if it does, add the line `map_d {}`",
                    100.0 * share,
                    colour.file
                );
                self.told.warn(of_entry(&entry), problem);
            }
            return None;
        };
        let map = match TextureMap::parse(text) {
            Ok(map) => map,
            Err(why) => {
                self.no_mask(&entry, text, &format!("cannot be used ({why})"));
                return None;
            }
        };
        let bytes = self.texture(&entry, &map.file);
        match bytes.and_then(|bytes| Picture::read(&bytes)) {
            Ok(picture) => {
                let channel = map.channel.unwrap_or(match picture.has_alpha() {
                    true => Channel::Alpha,
                    false => Channel::Luminance,
                });
                // programs name the picture of the colours for its alpha, which then is opaque
                let is_colour = colour.is_some_and(|colour| colour.file == map.file);
                if map.channel.is_none() && !picture.has_alpha() && !picture.is_grey() && is_colour
                {
                    return None;
                }
                let bitmap = picture.bitmap(channel, map.range);
                Some((entry, map, bitmap))
            }
            Err(why) => {
                self.no_mask(&entry, &map.file, &format!("cannot be used ({why})"));
                None
            }
        }
    }

    /// Reads a texture. Its path is relative to the MTL file; a path of another machine is looked
    /// for beside the MTL file.
    fn texture(&self, entry: &MtlEntry, file: &str) -> std::result::Result<Vec<u8>, String> {
        let mtl = entry.place.rsplit_once(':').map_or("", |(path, _)| path);
        let slashes = file.replace('\\', "/");
        let bare = slashes.rsplit('/').next().unwrap_or_default();
        let beside = |name: &str| Path::new(mtl).with_file_name(name);
        let folder = Path::new(mtl).parent().unwrap_or(Path::new(""));
        let places: [PathBuf; 3] = [folder.join(file), folder.join(&slashes), beside(bare)];
        let mut found = places.iter().map(|path| self.files.fetch(path));
        let first = found.next().unwrap_or_else(|| Err(String::new()));
        first.or_else(|why| found.find_map(|read| read.ok()).ok_or(why))
    }
}

fn of_entry(entry: &MtlEntry) -> String {
    format!("{}: material {}", entry.place, quoted(&entry.name))
}

/// What a mask has done to the faces of an object.
#[derive(Default)]
struct Cut {
    /// Area before and after, in the file's unit.
    before: f64,
    after: f64,
    /// Triangles without texture coordinates.
    bare: usize,
    /// The runs of faces of which nothing is left.
    gone: Vec<String>,
}
