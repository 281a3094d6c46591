"""The paper's table done again with its long studies: random meshes, and what the paper leaves open."""
