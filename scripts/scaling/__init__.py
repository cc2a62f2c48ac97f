"""How distances scale over ranks."""
