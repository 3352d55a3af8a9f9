//! The firmware's ELF: found, built, checked, read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use anyhow::{Context, bail, ensure};
use object::{Architecture, Object, ObjectSection, ObjectSymbol, SymbolKind};

/// How an image is made.
pub const BUILD: &str = "cargo fw-build";
/// How its target is made.
const TARGET: &str = "thumbv7em-none-eabihf";
/// 16 exceptions of the core and 91 interrupts of an STM32F42x (RM0090, table 62).
const VECTORS: u64 = 16 + 91;
const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0820_0000;
/// SRAM1 to SRAM3.
pub const RAM: std::ops::Range<u64> = 0x2000_0000..0x2003_0000;

/// A function or variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symbol {
    /// Its first byte.
    pub address: u64,
    /// Its length in bytes.
    pub size: u64,
}

/// A section that lies in the chip's memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Its name.
    pub name: String,
    /// Its first byte.
    pub address: u64,
    /// Its length in bytes.
    pub size: u64,
    /// Bytes of flash that it takes.
    pub flash: u64,
    /// Bytes of RAM that it takes.
    pub ram: u64,
}

/// An image of the firmware.
pub struct Image {
    /// Where it came from.
    pub path: PathBuf,
    /// The file.
    pub bytes: Vec<u8>,
    /// What is in the chip's memory.
    pub sections: Vec<Section>,
    /// How its messages are to be read. Lives as long as the program.
    pub messages: &'static decode::Image,
    functions: BTreeMap<String, Vec<Symbol>>,
    variables: BTreeMap<String, Symbol>,
}

/// The repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the package lies in the repository")
}

/// Builds the image, which takes no time if it is up to date, and gives its path.
pub fn build() -> anyhow::Result<PathBuf> {
    find_target()?;
    let status = Command::new("cargo")
        .args(["fw-build", "--quiet"])
        .current_dir(root())
        .env("DEFMT_LOG", "info")
        .status()
        .context("cannot run cargo")?;
    ensure!(
        status.success(),
        "the image does not build: run `{BUILD}` and mend what it says"
    );
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| root().join("target"), |dir| root().join(dir));
    Ok(target.join(TARGET).join("firmware/softgrip-fw"))
}

/// Whether the compiler has a `core` for the target.
fn find_target() -> anyhow::Result<()> {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", TARGET])
        .current_dir(root())
        .output()
        .context("cannot run rustc")?;
    let libraries = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let has_core = libraries.read_dir().is_ok_and(|files| {
        files
            .flatten()
            .any(|file| file.file_name().to_string_lossy().starts_with("libcore-"))
    });
    ensure!(
        has_core,
        "the compiler has no target {TARGET}: run `rustup target add {TARGET}`, or where that cannot \
         download, `.ci/thumb-target.sh`; or name an image that is built already, with --image"
    );
    Ok(())
}

impl Image {
    /// Reads an image for the chip that is emulated, and refuses one that is not this repository's firmware as it is now.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Self::read_for(path, check_chip)
    }

    /// Reads an image for any board, to look at its code.
    pub fn read_for_any_board(path: &Path) -> anyhow::Result<Self> {
        Self::read_for(path, check_core)
    }

    fn read_for(
        path: &Path,
        check: fn(&object::File<'_>) -> anyhow::Result<()>,
    ) -> anyhow::Result<Self> {
        let bytes = std::fs::read(path)
            .with_context(|| format!("{}: no image; run `{BUILD}`", path.display()))?;
        let image = Self::parse(path, bytes, check)
            .with_context(|| format!("{}: not an image to run; run `{BUILD}`", path.display()))?;
        image
            .check_age()
            .with_context(|| format!("{}: run `{BUILD}`", path.display()))?;
        Ok(image)
    }

    fn parse(
        path: &Path,
        bytes: Vec<u8>,
        check: fn(&object::File<'_>) -> anyhow::Result<()>,
    ) -> anyhow::Result<Self> {
        let file = object::File::parse(bytes.as_slice()).context("no ELF file")?;
        check(&file)?;
        let (functions, variables) = symbols(&file);
        ensure!(!functions.is_empty(), "no symbols");

        let messages = decode::Image::read(&bytes)?;
        let sections = file.sections().filter_map(section).collect();
        Ok(Self {
            path: path.into(),
            sections,
            messages: Box::leak(Box::new(messages)),
            functions,
            variables,
            bytes,
        })
    }

    /// Compares the image with the sources that cargo lists beside it.
    fn check_age(&self) -> anyhow::Result<()> {
        let list = self.path.with_extension("d");
        let text = std::fs::read_to_string(&list).with_context(|| {
            format!(
                "{}: without this list of sources nobody can tell how old the image is",
                list.display()
            )
        })?;
        let built = modified(&self.path)?;
        let sources = text.split_once(": ").map_or("", |(_, sources)| sources);
        // Spaces in a path are escaped.
        let sources = sources.replace("\\ ", "\0");
        for source in sources.split_whitespace() {
            let source = PathBuf::from(source.replace('\0', " "));
            if modified(&source).is_ok_and(|changed| changed > built) {
                bail!("older than its source {}", source.display());
            }
        }
        Ok(())
    }

    /// Where the stack lies: from the chip's start of RAM, or the last variable below, up to where it begins.
    pub fn stack(&self) -> anyhow::Result<std::ops::Range<u64>> {
        let file = object::File::parse(self.bytes.as_slice())?;
        let vectors = file
            .section_by_name(".vector_table")
            .context("no vectors")?;
        let first: [u8; 4] = vectors.data()?[..4].try_into()?;
        let top = u64::from(u32::from_le_bytes(first));
        let bottom = self
            .sections
            .iter()
            .filter(|section| section.ram > 0 && section.address < top)
            .map(|section| section.address + section.size)
            .max()
            .unwrap_or(RAM.start);
        Ok(bottom.next_multiple_of(4)..top)
    }

    /// The function whose name without generics ends like this.
    pub fn function(&self, name: &str) -> anyhow::Result<Symbol> {
        let mut found = self
            .functions
            .iter()
            .filter(|(full, _)| full.ends_with(name))
            .flat_map(|(_, symbols)| symbols);
        match (found.next(), found.next()) {
            (Some(symbol), None) => Ok(*symbol),
            (None, _) => bail!("the image has no function {name}"),
            (Some(_), Some(_)) => bail!("the image has more than one function {name}"),
        }
    }

    /// A function's code, in halfwords.
    pub fn code(&self, function: Symbol) -> anyhow::Result<Vec<u16>> {
        let file = object::File::parse(self.bytes.as_slice())?;
        let section = file.section_by_name(".text").context("no code")?;
        let bytes = section
            .data_range(function.address, function.size)?
            .context("a function outside the code")?;
        let (halves, _) = bytes.as_chunks::<2>();
        Ok(halves
            .iter()
            .map(|half| u16::from_le_bytes(*half))
            .collect())
    }

    /// Every function, with its name.
    pub fn functions(&self) -> impl Iterator<Item = (&str, Symbol)> {
        self.functions
            .iter()
            .flat_map(|(name, symbols)| symbols.iter().map(move |symbol| (name.as_str(), *symbol)))
    }

    /// The name of the function in which this address lies.
    pub fn function_at(&self, address: u64) -> Option<&str> {
        self.functions()
            .find(|(_, symbol)| (symbol.address..symbol.address + symbol.size).contains(&address))
            .map(|(name, _)| name)
    }

    /// The variable whose name ends like this.
    pub fn variable(&self, name: &str) -> anyhow::Result<Symbol> {
        self.variables
            .iter()
            .find(|(full, _)| full.ends_with(name))
            .map(|(_, symbol)| *symbol)
            .with_context(|| format!("the image has no variable {name}"))
    }
}

/// Refuses what was built for another kind of processor.
fn check_core(file: &object::File<'_>) -> anyhow::Result<()> {
    ensure!(
        file.architecture() == Architecture::Arm && !file.is_64(),
        "built for {:?}, not for ARM",
        file.architecture()
    );
    Ok(())
}

/// Refuses what was built for something else than the chip that is emulated.
fn check_chip(file: &object::File<'_>) -> anyhow::Result<()> {
    check_core(file)?;
    let vectors = file
        .section_by_name(".vector_table")
        .context("no section .vector_table")?;
    ensure!(
        vectors.address() == FLASH.start && vectors.size() == 4 * VECTORS,
        "built for another chip: {} vectors at {:#010x}, where an STM32F42x has {VECTORS} at {:#010x}",
        vectors.size() / 4,
        vectors.address(),
        FLASH.start
    );
    let stack: [u8; 4] = vectors.data()?[..4].try_into()?;
    let stack = u64::from(u32::from_le_bytes(stack));
    ensure!(
        stack > RAM.start && stack <= RAM.end,
        "built for another chip: its stack begins at {stack:#010x}, outside {:#010x} to {:#010x}",
        RAM.start,
        RAM.end
    );
    Ok(())
}

type Functions = BTreeMap<String, Vec<Symbol>>;
type Variables = BTreeMap<String, Symbol>;

/// The functions and variables by their full names.
fn symbols(file: &object::File<'_>) -> (Functions, Variables) {
    let mut functions = Functions::new();
    let mut variables = Variables::new();
    for symbol in file.symbols() {
        let Ok(name) = symbol.name() else { continue };
        // `<a::B>::c` is `a::B::c`, as compilers of different age write it.
        let name = format!("{:#}", rustc_demangle::demangle(name));
        let name = match name.strip_prefix('<') {
            Some(method) if !method.contains(" as ") => method.replacen('>', "", 1),
            _ => name,
        };
        let found = Symbol {
            // The lowest bit of a function's address says that it is Thumb code.
            address: symbol.address() & !1,
            size: symbol.size(),
        };
        match symbol.kind() {
            SymbolKind::Text => functions.entry(name).or_default().push(found),
            SymbolKind::Data => {
                variables.insert(name, found);
            }
            _ => {}
        }
    }
    (functions, variables)
}

/// How much of the chip's memory a section takes.
fn section(section: object::Section<'_, '_>) -> Option<Section> {
    let (address, size) = (section.address(), section.size());
    let in_ram = RAM.contains(&address);
    let name = section.name().ok()?.to_owned();
    // The initial values of .data lie in flash too.
    let flash = if FLASH.contains(&address) || name == ".data" {
        size
    } else {
        0
    };
    let ram = if in_ram { size } else { 0 };
    (size > 0 && flash + ram > 0).then_some(Section {
        name,
        address,
        size,
        flash,
        ram,
    })
}

fn modified(path: &Path) -> anyhow::Result<SystemTime> {
    std::fs::metadata(path)
        .and_then(|metadata| metadata.modified())
        .with_context(|| format!("{}", path.display()))
}
