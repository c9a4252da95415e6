"""The proof: effects that are in the data and concealed from the tool, and what it says of them."""
