//! Assembly and conventions on small images made here.
