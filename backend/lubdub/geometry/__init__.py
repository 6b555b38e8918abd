"""Pure numbers: surfaces, frames and units, nearest points, Chamfer distance, rigid alignment, sparse solves."""
