//! Film, tone mapping, image metrics, contact sheets, scene file, CPU renderer.
