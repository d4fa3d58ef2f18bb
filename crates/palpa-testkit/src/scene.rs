//! Scene files of blocks, built by calls.

use std::fmt;

/// A scene file. Lengths are in mm. A key that is set again has the last value.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    body: Table,
    layers: Vec<Layer>,
    lumps: Vec<Lump>,
    tables: Vec<Table>,
}

/// A layer of an elastic block.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer(Table);

/// A spherical lump.
#[derive(Debug, Clone, PartialEq)]
pub struct Lump(Table);

/// A value as a scene file writes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Value(String);

/// Keys and values under a name.
#[derive(Debug, Clone, PartialEq)]
struct Table {
    name: &'static str,
    entries: Vec<(&'static str, Value)>,
}

impl Scene {
    /// A block of this size with vertices at this spacing, mm.
    pub fn block(size: [f64; 3], spacing: f64) -> Self {
        let block = format!(
            "{{ kind = \"block\", size = {}, spacing = {} }}",
            Value::lengths(size).0,
            Value::length(spacing).0,
        );
        Self {
            body: Table::new("body").with("generator", Value(block)),
            layers: Vec::new(),
            lumps: Vec::new(),
            tables: vec![Table::new("tool"), Table::new("press")],
        }
    }

    /// The block of benchmark B2 under a ball without friction, 10 mm in radius: 2 mm of skin, 10
    /// mm of soft fat and 28 mm of muscle, in as many intervals between levels as given.
    pub fn skin_fat_muscle(fat_levels: u32, muscle_levels: u32) -> Self {
        Self::block([100.0, 100.0, 40.0], 12.0)
            .layer(Layer::elastic("skin", "100 kPa").thick(2.0))
            .layer(
                Layer::elastic("fat", "5 kPa")
                    .thick(10.0)
                    .levels(fat_levels),
            )
            .layer(Layer::elastic("muscle", "30 kPa").levels(muscle_levels))
            .sphere(10.0)
    }

    /// A soft layer over one four times as stiff, each in two intervals, under a bonded disc of a
    /// radius. mm
    pub fn soft_over_stiff(size: [f64; 3], spacing: f64, soft: f64, disc: f64) -> Self {
        Self::block(size, spacing)
            .layer(Layer::elastic("soft", "10 kPa").thick(soft).levels(2))
            .layer(Layer::elastic("stiff", "40 kPa").levels(2))
            .disc(disc)
    }

    /// Another block in the place of this one, mm.
    #[must_use]
    pub fn sized(self, size: [f64; 3], spacing: f64) -> Self {
        let block = Self::block(size, spacing);
        let generator = block.body.get("generator").clone();
        self.set("body", "generator", generator)
    }

    /// The next layer, from the skin down. The last has no thickness: it takes the rest.
    #[must_use]
    pub fn layer(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// Replaces a layer; 0 is the skin's.
    ///
    /// # Panics
    /// When there is no such layer.
    #[must_use]
    pub fn with_layer(mut self, i: usize, change: impl FnOnce(Layer) -> Layer) -> Self {
        self.layers[i] = change(self.layers[i].clone());
        self
    }

    /// A lump.
    #[must_use]
    pub fn lump(mut self, lump: Lump) -> Self {
        self.lumps.push(lump);
        self
    }

    /// A ball of this radius, mm.
    #[must_use]
    pub fn sphere(self, radius: f64) -> Self {
        self.tool("sphere", radius)
    }

    /// A disc of this radius that holds what is under it, mm.
    #[must_use]
    pub fn disc(self, radius: f64) -> Self {
        self.tool("disc", radius)
    }

    /// A tool of a shape and a radius, mm.
    #[must_use]
    pub fn tool(self, shape: &str, radius: f64) -> Self {
        self.set("tool", "shape", shape)
            .set("tool", "radius", Value::length(radius))
    }

    /// Presses at the origin, the middle of the block's upper face, so deep, mm.
    #[must_use]
    pub fn press(self, depth: f64) -> Self {
        self.set("press", "at", Value::lengths([0.0; 3])).set(
            "press",
            "depth",
            Value::length(depth),
        )
    }

    /// Edges near the tool, mm.
    #[must_use]
    pub fn near_tool(self, edge: f64) -> Self {
        self.set("mesh", "near_tool", Value::length(edge))
    }

    /// How fast edges grow away from the tool, mm a mm.
    #[must_use]
    pub fn growth(self, growth: f64) -> Self {
        self.set("mesh", "growth", growth)
    }

    /// A motion of the hand, so deep, mm.
    #[must_use]
    pub fn motion(self, kind: &str, depth: f64) -> Self {
        self.set("motion", "kind", kind)
            .set("motion", "depth", Value::length(depth))
    }

    /// Sets a key of a table of the scene file.
    ///
    /// ```
    /// use palpa_testkit::Scene;
    ///
    /// let scene = Scene::block([60.0, 60.0, 30.0], 8.0).set("press", "step", "1 mm");
    /// assert!(scene.to_string().ends_with("step = \"1 mm\"\n"));
    /// ```
    #[must_use]
    pub fn set(mut self, table: &'static str, key: &'static str, value: impl Into<Value>) -> Self {
        self.table(table).set(key, value.into());
        self
    }

    /// Takes a key out of a table.
    ///
    /// # Panics
    /// When it is not there.
    #[must_use]
    pub fn without(mut self, table: &'static str, key: &'static str) -> Self {
        let entries = &mut self.table(table).entries;
        let at = entries.iter().position(|(k, _)| *k == key);
        entries.remove(at.unwrap_or_else(|| panic!("no {key} in [{table}]")));
        self
    }

    fn table(&mut self, name: &'static str) -> &mut Table {
        if name == "body" {
            return &mut self.body;
        }
        let at = self.tables.iter().position(|t| t.name == name);
        let at = at.unwrap_or_else(|| {
            self.tables.push(Table::new(name));
            self.tables.len() - 1
        });
        &mut self.tables[at]
    }
}

impl fmt::Display for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("# A scene of the tests.\n")?;
        self.body.fmt(f)?;
        let parts = self.layers.iter().map(|layer| &layer.0);
        let lumps = self.lumps.iter().map(|lump| &lump.0);
        let mut parts = parts.chain(lumps).chain(&self.tables);
        parts.try_for_each(|table| table.fmt(f))
    }
}

impl From<&Scene> for String {
    fn from(scene: &Scene) -> Self {
        scene.to_string()
    }
}

impl From<Scene> for String {
    fn from(scene: Scene) -> Self {
        scene.to_string()
    }
}

impl Layer {
    /// Nearly incompressible neo-Hookean: Young's modulus with its unit, Poisson's ratio 0.45.
    pub fn elastic(name: &str, young: &str) -> Self {
        Self(Table::new("[layer]").with("tissue", Value::elastic(name, young)))
    }

    /// A tissue by the entries of its table: `name = "x", law = "yeoh", …`.
    pub fn of(tissue: &str) -> Self {
        Self(Table::new("[layer]").with("tissue", Value(format!("{{ {tissue} }}"))))
    }

    /// Thickness, mm.
    #[must_use]
    pub fn thick(self, thickness: f64) -> Self {
        self.set("thickness", Value::length(thickness))
    }

    /// Intervals between levels.
    #[must_use]
    pub fn levels(self, levels: u32) -> Self {
        self.set("levels", Value(levels.to_string()))
    }

    /// Sets a key of the layer.
    #[must_use]
    pub fn set(mut self, key: &'static str, value: impl Into<Value>) -> Self {
        self.0.set(key, value.into());
        self
    }
}

impl Lump {
    /// A sphere of this radius (mm), nearly incompressible: a name and Young's modulus with its
    /// unit.
    pub fn sphere(radius: f64, name: &str, young: &str) -> Self {
        Self(
            Table::new("[lump]")
                .with("shape", "sphere".into())
                .with("radius", Value::length(radius))
                .with("tissue", Value::elastic(name, young)),
        )
    }

    /// With its centre at a point, mm.
    #[must_use]
    pub fn at(self, centre: [f64; 3]) -> Self {
        self.set("at", Value::lengths(centre))
    }

    /// With its centre so deep below the origin, mm.
    #[must_use]
    pub fn below(self, depth: f64) -> Self {
        self.set("below", Value::lengths([0.0; 3]))
            .set("depth", Value::length(depth))
    }

    /// Sets a key of the lump.
    #[must_use]
    pub fn set(mut self, key: &'static str, value: impl Into<Value>) -> Self {
        self.0.set(key, value.into());
        self
    }
}

impl Value {
    /// TOML as it stands.
    pub fn raw(toml: impl Into<String>) -> Self {
        Self(toml.into())
    }

    /// A length in mm.
    pub fn length(mm: f64) -> Self {
        Self(format!("\"{mm} mm\""))
    }

    /// A place in mm.
    pub fn lengths(mm: [f64; 3]) -> Self {
        let [x, y, z] = mm.map(|mm| Self::length(mm).0);
        Self(format!("[{x}, {y}, {z}]"))
    }

    fn elastic(name: &str, young: &str) -> Self {
        Self(format!(
            "{{ name = \"{name}\", young = \"{young}\", poisson = 0.45 }}"
        ))
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self(format!("\"{text}\""))
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self(format!("{number:?}"))
    }
}

impl From<bool> for Value {
    fn from(is_so: bool) -> Self {
        Self(is_so.to_string())
    }
}

impl Table {
    fn new(name: &'static str) -> Self {
        Self {
            name,
            entries: Vec::new(),
        }
    }

    fn with(mut self, key: &'static str, value: Value) -> Self {
        self.set(key, value);
        self
    }

    fn set(&mut self, key: &'static str, value: Value) {
        match self.entries.iter_mut().find(|(k, _)| *k == key) {
            Some((_, old)) => *old = value,
            None => self.entries.push((key, value)),
        }
    }

    fn get(&self, key: &str) -> &Value {
        let entry = self.entries.iter().find(|(k, _)| *k == key);
        &entry
            .unwrap_or_else(|| panic!("no {key} in [{}]", self.name))
            .1
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "[{}]", self.name)?;
        let mut entries = self.entries.iter();
        entries.try_for_each(|(key, value)| writeln!(f, "{key} = {}", value.0))
    }
}
