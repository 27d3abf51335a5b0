"""The methods of the papers, separate from papilla's own: roughness as printed and corrected, wavelets, textiles."""
