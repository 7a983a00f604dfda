"""Example scenes, installed with relume: `relume scenes` lists and copies them."""
