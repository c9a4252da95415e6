"""Physical constants (CODATA 2018, exact in the SI)."""

FARADAY_C_mol = 96485.33212
GAS_J_mol_K = 8.314462618
ZERO_CELSIUS_K = 273.15
