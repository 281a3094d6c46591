"""From struts to moduli: effective elasticity, virtual compression tests and a law for the analysis mesh."""
