"""Presses on a condensed finger: closed-form and complementarity contact, and the choice between them."""
