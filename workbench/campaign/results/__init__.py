"""What is made of stored runs: exports, why and where runs fail, functionals of histories, some of many."""
