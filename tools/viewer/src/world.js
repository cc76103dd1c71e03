// All meshes of the page, in the coordinates of the first one, and the points beside them.

import { Box3, Color, Sphere, Vector3 } from 'three';
import { Cloud } from './cloud.js';
import { MeshView } from './mesh.js';
import { shared } from './material.js';
import { classTexture, rampTexture } from './ramps.js';

/** Triangles that are drawn at most, as far as levels of detail allow. */
const MOST_TRIANGLES = 6e6;

/** The one colour of each mesh. */
const FRONTS = [ new Color( 0.80, 0.775, 0.73 ), new Color( 0.86, 0.62, 0.42 ) ];

/** What is farther from the first mesh than so many times the radii of both may have other coordinates. */
const ASTRAY = 5;

/** Before there is anything. */
const NOTHING = { sphere: new Sphere( new Vector3(), 1 ), box: new Box3( new Vector3( - 1, - 1, - 1 ), new Vector3( 1, 1, 1 ) ) };

export class World {

	/** `changed` is called when something new is to be drawn, `opened` with a mesh, `failed` with one and a message. */
	constructor( renderer, camera, scene, { changed, opened, failed } ) {

		Object.assign( this, { renderer, camera, scene, changed, opened, failed } );
		this.meshes = [];
		this.cloud = new Cloud( changed );
		this.settings = { detail: 1.5, budget: 1024, wires: false, edges: false };
		this.mode = 'plain';
		this.ranges = new Map();
		shared.uRamp.value = rampTexture();
		shared.uClasses.value = classTexture();

	}

	/** Adds a part that is there. */
	add( part ) {

		if ( part.kind === 'points' ) return this.#points( part );
		const mesh = new MeshView( this.renderer, this.camera, {
			part, front: FRONTS[ this.meshes.length ], changed: this.changed,
			failed: ( name, why ) => this.failed( mesh, name, why ),
			opened: () => this.#open( mesh ),
		} );
		this.meshes.push( mesh );
		this.scene.add( mesh.tiles.group );
		this.#set();

	}

	async #points( part ) {

		try {

			this.scene.add( await this.cloud.load( part ) );
			this.#bound();
			this.opened( null );

		} catch ( error ) {

			this.failed( null, part.name, `its points cannot be loaded: ${ error?.message ?? error }` );

		}

		this.changed();

	}

	/** The tree of a mesh is there; the first one comes first, because the others are placed beside it. */
	#open( mesh ) {

		if ( ! this.first.box ) return;
		this.#bound();
		for ( const one of mesh === this.first ? this.open : [ mesh ] ) this.opened( one );

	}

	/** Gives all meshes the settings; the memory is shared. */
	#set() {

		const { detail, budget, wires, edges } = this.settings;
		for ( const mesh of this.meshes ) Object.assign( mesh, { detail, budget: budget / this.meshes.length, showWires: wires, showEdges: edges } );
		this.changed();

	}

	set( settings ) {

		Object.assign( this.settings, settings );
		this.#set();

	}

	/** The box and the sphere around everything. */
	#bound() {

		const boxes = [ ...this.open.map( mesh => mesh.box ), ...( this.cloud.box ? [ this.cloud.box ] : [] ) ];
		const box = boxes.reduce( ( all, box ) => all.union( box ), new Box3() );
		const spheres = this.open.map( mesh => mesh.sphere );
		const sphere = spheres.length === 1 && boxes.length === 1 ? spheres[ 0 ] : box.getBoundingSphere( new Sphere() );
		this.bounds = { box, sphere };

	}

	/** The distance of something from the first mesh, if it is so far away that it may be there by mistake; else null. */
	astray( box ) {

		const other = box.getBoundingSphere( new Sphere() ), { center, radius } = this.first.sphere;
		const distance = other.center.distanceTo( center );
		return distance > ASTRAY * ( other.radius + radius ) ? distance : null;

	}

	/** Meshes of which the tree of tiles is there, once that of the first one is. */
	get open() { return this.first?.box ? this.meshes.filter( mesh => mesh.box ) : []; }

	get first() { return this.meshes[ 0 ]; }

	get box() { return ( this.bounds ?? NOTHING ).box; }

	get sphere() { return ( this.bounds ?? NOTHING ).sphere; }

	get info() { return this.first.info; }

	get decimals() { return this.first.decimals; }

	/** True while something is on its way. */
	get isLoading() { return this.meshes.some( mesh => ! mesh.box || mesh.tiles.isLoading ) || this.cloud.loading !== null; }

	toLocal( scan ) { return this.first.toLocal( scan ); }

	toScan( local ) { return this.first.toScan( local ); }

	/** Begins with another camera. */
	use( camera ) {

		this.camera = camera;
		for ( const mesh of this.meshes ) mesh.use( camera, this.renderer );

	}

	update( camera, factor ) { for ( const mesh of this.meshes ) mesh.update( camera, this.renderer, factor ); }

	/** Makes the next frames coarser if there are too many triangles, or less so if there are few. */
	limit( triangles ) {

		for ( const mesh of this.meshes ) mesh.limit( triangles > MOST_TRIANGLES ? 1 : triangles < 0.6 * MOST_TRIANGLES ? - 1 : 0 );

	}

	/** Counts of what is drawn: tiles and triangles of `shown`, memory of all. */
	stats( shown ) {

		const each = this.meshes.map( mesh => ( { ...mesh.stats(), shown: shown.includes( mesh ) } ) );
		const sum = ( name, of = each ) => of.reduce( ( total, stats ) => total + stats[ name ], 0 );
		const seen = each.filter( stats => stats.shown );
		return {
			triangles: sum( 'triangles', seen ), tiles: sum( 'tiles', seen ), loading: sum( 'loading' ), held: sum( 'held' ), bytes: sum( 'bytes' ), missing: sum( 'missing' ),
			full: each.some( stats => stats.full ), coarser: Math.max( 1, ...each.map( stats => stats.coarser ) ),
		};

	}

	// Colours.

	/** The properties of any mesh that colours can show, and what they are called. */
	get modes() {

		const names = [ ...new Set( this.open.flatMap( mesh => mesh.info.columns.map( column => column.name ) ) ) ];
		const columns = names.filter( name => ! [ 'red', 'green', 'blue', 'nx', 'ny', 'nz' ].includes( name ) );
		return [ [ 'plain', 'One colour' ], ...( this.open.some( mesh => mesh.hasColors ) ? [ [ 'color', 'Scan colour' ] ] : [] ), [ 'height', 'Height' ],
			...columns.map( name => [ `column:${ name }`, name[ 0 ].toUpperCase() + name.slice( 1 ).replaceAll( '_', ' ' ) ] ), [ 'tile', 'Tile' ], [ 'level', 'Level of detail' ] ];

	}

	/** Colours by plain, color, height, tile, level, or column:NAME. */
	colorBy( mode ) {

		this.mode = mode;
		for ( const mesh of this.open ) mesh.colorBy( mode, this.offset( mode ) );
		// What more is known of the values by now counts, unless somebody chose them.
		if ( ! this.ranges.get( mode )?.chosen ) this.ranges.delete( mode );
		const range = this.range( mode );
		if ( range ) shared.uRange.value.set( range.low, range.high, 0, 0 );
		this.changed();

	}

	/** What is added to the values of a column, for all meshes. */
	offset( mode ) {

		const name = mode.startsWith( 'column:' ) ? mode.slice( 7 ) : null;
		return this.open.map( mesh => mesh.column( name )?.offset ).find( offset => offset !== undefined ) ?? 0;

	}

	isClass( name ) { return name === 'classification'; }

	/** The values at the ends of the ramp; of a column less its offset. */
	range( mode ) {

		if ( ! this.ranges.has( mode ) ) {

			const found = this.open.map( mesh => mesh.measure( mode, this.offset( mode ) ) ).filter( Boolean );
			if ( found.length === 0 ) return null;
			const [ low, high ] = [ Math.min( ...found.map( range => range.low ) ), Math.max( ...found.map( range => range.high ) ) ];
			this.ranges.set( mode, { low, high: high > low ? high : low + 1 } );

		}

		return this.ranges.get( mode );

	}

	setRange( mode, low, high ) {

		this.ranges.set( mode, { low, high, chosen: true } );
		shared.uRange.value.set( low, high, 0, 0 );
		this.changed();

	}

	/** The classes that occur in tiles in memory. */
	classes( name ) { return [ ...new Set( this.open.flatMap( mesh => mesh.classes( name ) ) ) ].sort( ( a, b ) => a - b ); }

}
