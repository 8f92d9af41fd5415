"""`python -m mirotwin`: the program, where its folder is not on the path."""

from mirotwin.entry import main

if __name__ == "__main__":
    main()
