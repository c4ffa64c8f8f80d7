//! Files of results as their readers meet them.

mod files;
