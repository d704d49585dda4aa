#pragma once

namespace flexboom {

/// For the head of main(): blocks up to 256 MiB that are freed stay with the program for the next ones. By itself glibc
/// hands every large block back, and touching it anew costs 4 % of the time of an eigen-solve.
void keep_freed_memory();

/// For the head of main(): CHOLMOD's large blocks are asked for in pages of 2 MiB. A factor of 5 GB is a million small
/// pages, whose first touch costs up to a fifth of the factorisation.
void factors_on_huge_pages();

/// What was freed goes back to the system: before a factor, the largest block of all, is made, and before the vectors
/// that are solved for.
void return_freed_memory();

}  // namespace flexboom
