"""What a design is judged by: spread, correlation, discrepancy and the efficiencies of regression models."""
