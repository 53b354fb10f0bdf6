"""The attacks by group. Each module has a list ROWS; table.py joins these lists."""
