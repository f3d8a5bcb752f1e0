#![no_main]
teachtree_fuzz::target!(teachtree_fuzz::language::lsp);
