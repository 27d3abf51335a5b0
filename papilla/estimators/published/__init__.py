"""The methods of the papers, apart from the product's own: roughness as printed and corrected, wavelets, textiles."""
