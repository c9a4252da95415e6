"""The paper's result figures and statements (arXiv 2603.12791), reproduced."""
