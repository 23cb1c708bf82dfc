//! Parameters of analytic reflectance as BRDFLab keeps them (Forés, Pattanaik, Bosch & Pueyo 2009, "BRDFLab:
//! A General System for Designing BRDFs"): XML with one or more sums of lobes, each a model's name and its
//! numbers. Plain data: what the models are is the reader's.

use super::text;
use crate::{FormatError, Limits};
use roxmltree::{Document, Node, ParsingOptions};
use std::path::Path;
use steradian_base::brief;

/// One lobe.
#[derive(Debug, Clone, PartialEq)]
pub struct BrdfLabLobe {
    /// Name of its model, such as `CookTorrance`.
    pub model: String,
    /// The channel that it is of; `None`: of all.
    pub channel: Option<usize>,
    /// Factors per channel, where it has any.
    pub scale: Option<[f64; 3]>,
    /// Names and finite numbers.
    pub parameters: Vec<(String, f64)>,
}

/// One sum of lobes.
#[derive(Debug, Clone, PartialEq)]
pub struct BrdfLabFit {
    /// Its name, such as `Ngan-Ward`.
    pub name: String,
    /// The error that the file states.
    pub error: Option<f64>,
    /// Its lobes.
    pub lobes: Vec<BrdfLabLobe>,
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct BrdfLab {
    /// At least one.
    pub fits: Vec<BrdfLabFit>,
}

/// Nodes of the tree at most: a file of ours has some hundreds.
const MAX_NODES: u32 = 1 << 17;
/// Lobes of one fit at most.
const MAX_LOBES: usize = 64;

/// Decodes such a file that lies in memory; `name` is for messages.
pub fn decode_brdflab(name: &Path, bytes: &[u8], limits: &Limits) -> Result<BrdfLab, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let text = text(name, bytes, limits)?;
    // A declaration of the type is usual in these files; entities of its own are not.
    if text.contains("<!ENTITY") {
        return Err(invalid("declares entities, which such a file has none of".into()));
    }
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(text, options).map_err(|e| invalid(format!("no XML: {e}")))?;
    let root = document.root_element();
    if root.tag_name().name() != "BRDF" {
        let found = brief(root.tag_name().name()).into_owned();
        return Err(invalid(format!("its root is <{found}>, not <BRDF> as BRDFLab's is")));
    }
    let mut fits = Vec::new();
    let analytic = |n: &Node<'_, '_>| text_of(*n, "Type").is_some_and(|t| t == "Analytic");
    for material in root.descendants().filter(|n| n.has_tag_name("Material")).filter(analytic) {
        fits.push(fit(material).map_err(invalid)?);
    }
    if fits.is_empty() {
        return Err(invalid("holds no <Material> of the type Analytic".into()));
    }
    Ok(BrdfLab { fits })
}

/// The text of the child `tag`.
fn text_of<'a>(node: Node<'a, '_>, tag: &str) -> Option<&'a str> {
    node.children().find(|n| n.has_tag_name(tag))?.text().map(str::trim)
}

fn fit(material: Node<'_, '_>) -> Result<BrdfLabFit, String> {
    let name = text_of(material, "Name").unwrap_or_default().to_owned();
    let fault = |what: String| format!("material '{}': {what}", brief(&name));
    let stated = material.ancestors().find(|n| n.has_tag_name("Fitting")).and_then(|n| n.attribute("error"));
    let error = stated.and_then(|e| e.trim().parse().ok()).filter(|e: &f64| e.is_finite());
    let parameters = material.children().find(|n| n.has_tag_name("Parameters"));
    let parameters = parameters.ok_or_else(|| fault("has no <Parameters>".into()))?;
    let (mut lobes, mut scale) = (Vec::new(), None);
    for node in parameters.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "ScalingFactors" => scale = Some(scaling(node).map_err(fault)?),
            "Lobe" => lobes.push(lobe(node, scale.take()).map_err(fault)?),
            _ => {}
        }
        if lobes.len() > MAX_LOBES {
            return Err(fault(format!("has more than {MAX_LOBES} lobes")));
        }
    }
    if lobes.is_empty() {
        return Err(fault("has no <Lobe>".into()));
    }
    Ok(BrdfLabFit { name, error, lobes })
}

fn scaling(node: Node<'_, '_>) -> Result<[f64; 3], String> {
    let mut out = [0.0; 3];
    for (value, key) in out.iter_mut().zip(["channel0", "channel1", "channel2"]) {
        let text = node.attribute(key).ok_or_else(|| format!("a <ScalingFactors> has no {key}"))?;
        *value = number(key, text)?;
    }
    Ok(out)
}

fn number(key: &str, text: &str) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|v: &f64| v.is_finite());
    value.ok_or_else(|| format!("{} = '{}' is not a finite number", brief(key), brief(text)))
}

fn lobe(node: Node<'_, '_>, scale: Option<[f64; 3]>) -> Result<BrdfLabLobe, String> {
    let model = text_of(node, "Model").ok_or("a <Lobe> has no <Model>")?.to_owned();
    let channel = match node.attribute("channel") {
        None => None,
        Some(text) => Some(
            text.trim()
                .parse()
                .ok()
                .filter(|c| *c < 3)
                .ok_or_else(|| format!("channel '{}' is none of 0, 1, 2", brief(text)))?,
        ),
    };
    let parameters = node.children().find(|n| n.has_tag_name("Parameters"));
    let all = parameters.into_iter().flat_map(|n| n.attributes());
    let parameters = all
        .map(|a| Ok((a.name().to_owned(), number(a.name(), a.value())?)))
        .collect::<Result<_, String>>()?;
    Ok(BrdfLabLobe { model, channel, scale, parameters })
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    const WHOLE: &str = r#"<!DOCTYPE BRDF>
<BRDF>
 <Material><Type>MERLBRDFDatabase</Type></Material>
 <Fitting error="0.5">
  <Material>
   <Name>A-Ward</Name><Type>Analytic</Type>
   <Parameters nLobes="2">
    <ScalingFactors channel0="0.1" channel1="0.2" channel2="0.3" />
    <Lobe><Model>Lambertian</Model><Parameters/></Lobe>
    <Lobe channel="1"><Model>Ward</Model><Parameters ax="2.43e-002"/></Lobe>
   </Parameters>
  </Material>
 </Fitting>
</BRDF>"#;

    fn read(text: &str) -> Result<BrdfLab, String> {
        decode_brdflab(Path::new("a.xml"), text.as_bytes(), &Limits::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn fits_and_faults() {
        let all = read(WHOLE).expect("valid");
        let fit = &all.fits[0];
        assert_eq!((fit.name.as_str(), fit.error, fit.lobes.len()), ("A-Ward", Some(0.5), 2));
        assert_eq!(fit.lobes[0].scale, Some([0.1, 0.2, 0.3]));
        assert_eq!((fit.lobes[1].channel, fit.lobes[1].scale), (Some(1), None));
        assert_eq!(fit.lobes[1].parameters, [("ax".to_owned(), 0.0243)]);
        let with = |a: &str, b: &str| WHOLE.replace(a, b);
        for (text, part) in [
            (String::new(), "empty"),
            (WHOLE[..200].to_owned(), "no XML"),
            ("<A/>".into(), "its root is <A>"),
            ("<BRDF/>".into(), "no <Material>"),
            (with("2.43e-002", "nan"), "ax = 'nan'"),
            (with("channel=\"1\"", "channel=\"7\""), "channel '7'"),
            (with("channel1", "channel9"), "no channel1"),
            (with("Model>", "Modell>"), "no <Model>"),
            (with("Lobe", "Lobes"), "no <Lobe>"),
            (with("<!DOCTYPE BRDF>", "<!DOCTYPE BRDF [<!ENTITY a \"b\">]>"), "declares entities"),
        ] {
            let e = read(&text).expect_err(part);
            assert!(e.contains(part) && e.starts_with("a.xml: ") && !e.contains('\n'), "{part}: {e}");
        }
        let deep = format!("<BRDF>{}", "<a>".repeat(100_000));
        assert!(read(&deep).is_err());
        let mut damage = Mutator::new(8);
        for _ in 0..20_000 {
            let bytes = damage.damage(WHOLE.as_bytes(), b"<&\"-1e39 nan");
            let _ = decode_brdflab(Path::new("a.xml"), &bytes, &Limits::default());
        }
    }
}
